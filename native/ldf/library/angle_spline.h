// Interpolation between angles of incidence.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ldf/radial/ldf_source.h"

namespace beamspread {

// Cubic spline (not-a-knot) through nodes x >= 0 and their mirror images -x. A beam from the other side gives the
// mirrored distribution: harmonics of even m are even functions of the angle, those of odd m odd functions. The
// interpolant is linear in the values, hence totals agree with the distributions.
class AngleSpline {
public:
    enum class Parity { even, odd };

    AngleSpline() = default;

    // Nodes in radians, ascending.
    explicit AngleSpline(std::vector<double> nodes);

    // Weight of each node's value in the interpolated value at x.
    std::vector<double> weights(double x, Parity parity) const;

private:
    std::vector<double> m_nodes;
    std::vector<double> m_points;             // nodes and their mirror images, ascending
    std::vector<double> m_second_derivative;  // of the cardinal splines, [point][value]
};

// Angles of incidence with known values, and splines between them. The variable is the angle outside the medium, in
// which the refracted angle and the Fresnel factor of light from a slab's other boundary are smooth. As a function of
// the angle inside, that factor has an infinite slope at grazing.
class AngleNodes {
public:
    AngleNodes() = default;

    // Angles in degrees, ascending. Throws InvalidArgument.
    explicit AngleNodes(std::vector<double> angles_deg);

    const std::vector<double>& angles_deg() const { return m_angles_deg; }
    std::size_t count() const { return m_angles_deg.size(); }

    // The angle, clamped to the first and last node.
    double clamped(double angle_deg) const;

    // The two nodes around an angle.
    std::array<std::size_t, 2> neighbours(double angle_deg) const;

    // Weights of the nodes at the clamped angle, times a factor.
    LdfSource::AngleWeights weights(double angle_deg, double factor) const;

private:
    std::vector<double> m_angles_deg;
    AngleSpline m_spline;
};

// The angles, and the middle of each two neighbours.
std::vector<double> with_middles(const std::vector<double>& angles_deg);

}  // namespace beamspread
