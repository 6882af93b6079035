// Interpolation in the angle of incidence.
#pragma once

#include <vector>

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

}  // namespace beamspread
