// Interpolation between angles of incidence.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ldf/radial/ldf_source.h"

namespace beamspread {

// Cubic spline (not-a-knot) through nodes x >= 0 and their mirror images -x: a beam from the other
// side gives the mirrored distribution, so a harmonic of even m is an even function of the angle and
// one of odd m an odd function. The interpolant is linear in the values, which keeps every total
// consistent with the distribution that it is the total of.
class AngleSpline {
public:
    enum class Parity { even, odd };

    AngleSpline() = default;

    // Ascending nodes, radians.
    explicit AngleSpline(std::vector<double> nodes);

    // Weight of each node's value in the interpolated value at x.
    std::vector<double> weights(double x, Parity parity) const;

private:
    std::vector<double> m_nodes;
    std::vector<double> m_points;             // nodes and their mirror images, ascending
    std::vector<double> m_second_derivative;  // [point][value]: of the cardinal splines
};

// Splines over the angle outside the medium, where both the refracted angle and the Fresnel factor of light that comes
// back from a slab's other boundary are smooth; inside, the latter rises infinitely fast toward grazing.
class AngleNodes {
public:
    AngleNodes() = default;

    // Degrees, ascending. Throws InvalidArgument.
    explicit AngleNodes(std::vector<double> angles_deg);

    const std::vector<double>& angles_deg() const { return m_angles_deg; }
    std::size_t count() const { return m_angles_deg.size(); }

    // The nearest angle between the first and the last.
    double clamped(double angle_deg) const;

    // Nodes around an angle.
    std::array<std::size_t, 2> neighbours(double angle_deg) const;

    // Weights of the nodes at the clamped angle, times a factor.
    LdfSource::AngleWeights weights(double angle_deg, double factor) const;

private:
    std::vector<double> m_angles_deg;
    AngleSpline m_spline;
};

// The same angles, and one in the middle of each two.
std::vector<double> with_middles(const std::vector<double>& angles_deg);

}  // namespace beamspread
