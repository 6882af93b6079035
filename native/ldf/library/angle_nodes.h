// Angles of incidence that something is known at, and how to go between them.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ldf/library/angle_spline.h"
#include "ldf/radial/ldf_source.h"

namespace beamspread {

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
