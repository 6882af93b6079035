#include "ldf/library/angle_nodes.h"

#include <algorithm>
#include <utility>

#include "base/constants.h"
#include "base/error.h"

namespace beamspread {

AngleNodes::AngleNodes(std::vector<double> angles_deg) : m_angles_deg(std::move(angles_deg))
{
    std::vector<double> nodes;
    for (const double angle : m_angles_deg) {
        const double node = angle * radians_per_degree;
        // Closer nodes would only amplify the simulation's noise.
        if (!nodes.empty() && !(node - nodes.back() > 1e-3))
            reject("angles", angle, "distinct angles, at least 0.1 degrees apart");
        nodes.push_back(node);
    }
    m_spline = AngleSpline(std::move(nodes));
}

double AngleNodes::clamped(double angle_deg) const
{
    return std::clamp(angle_deg, m_angles_deg.front(), m_angles_deg.back());
}

std::array<std::size_t, 2> AngleNodes::neighbours(double angle_deg) const
{
    std::size_t j = 0;
    while (j + 2 < count() && angle_deg >= m_angles_deg[j + 1])
        ++j;
    return {j, std::min(j + 1, count() - 1)};
}

LdfSource::AngleWeights AngleNodes::weights(double angle_deg, double factor) const
{
    const double theta = clamped(angle_deg) * radians_per_degree;
    LdfSource::AngleWeights weights{m_spline.weights(theta, AngleSpline::Parity::even),
                                    m_spline.weights(theta, AngleSpline::Parity::odd), neighbours(angle_deg)};
    for (double& w : weights.even)
        w *= factor;
    for (double& w : weights.odd)
        w *= factor;
    return weights;
}

AngleNodes AngleNodes::refined() const
{
    std::vector<double> angles;
    for (const double angle : m_angles_deg) {
        if (!angles.empty())
            angles.push_back(0.5 * (angles.back() + angle));
        angles.push_back(angle);
    }
    return AngleNodes(std::move(angles));
}

}  // namespace beamspread
