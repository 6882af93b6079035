// LDF of a beam that lights a disk instead of a point.
#pragma once

#include <vector>

#include "ldf/radial/radial_function.h"

namespace beamspread {

// Convolution of an LDF with an evenly lit disk of total weight 1. A disk is symmetric, hence the result has the same
// harmonics; their radial functions are the means of g cos(m phi) over disks, by Green's theorem integrals of
// C_m(r) cos(m phi) d phi around the disks' borders.
class DiskProfile final : public RadialFunction {
public:
    // radius > 0. Keeps the total.
    DiskProfile(const RadialFunction& point, double radius);

    std::size_t harmonics() const override { return m_harmonics; }
    Harmonics cumulative(double r) const override;
    Harmonics remaining(double r) const override;
    double support() const override { return m_radii.back(); }
    double edge() const override { return m_edge; }

private:
    std::size_t m_harmonics;
    double m_edge;
    std::vector<double> m_radii;  // ascending from 0
    std::vector<Harmonics> m_remaining;
    std::vector<Harmonics> m_slope;  // dC_m/dr
};

// Area of the intersection of a disk of this radius around the origin with the rectangle [x0, x1] x [y0, y1].
double disk_overlap(double radius, double x0, double x1, double y0, double y1);

}  // namespace beamspread
