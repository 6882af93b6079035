#include "ldf/library/angle_nodes.h"

#include <algorithm>
#include <utility>

#include "base/constants.h"
#include "base/error.h"

namespace beamspread {

namespace {

// Closer nodes would only amplify the simulation's noise: at this distance 1e-3 of it are a slope of 1 per radian, which is
// about that of the LDFs.
constexpr double closest_deg = 0.06;

}  // namespace

AngleNodes::AngleNodes(std::vector<double> angles_deg) : m_angles_deg(std::move(angles_deg))
{
    for (std::size_t j = 1; j < count(); ++j)
        if (!(m_angles_deg[j] - m_angles_deg[j - 1] > closest_deg))
            reject("angles", m_angles_deg[j], "distinct angles, more than 0.06 degrees apart");
    std::vector<double> nodes;
    for (const double angle : m_angles_deg)
        // A node's mirror image is a node as well: one that is as close as that stands for both, at 0.
        nodes.push_back(angle < 0.5 * closest_deg ? 0.0 : angle * radians_per_degree);
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

std::vector<double> with_middles(const std::vector<double>& angles_deg)
{
    std::vector<double> all;
    for (const double angle : angles_deg) {
        if (!all.empty())
            all.push_back(0.5 * (all.back() + angle));
        all.push_back(angle);
    }
    return all;
}

}  // namespace beamspread
