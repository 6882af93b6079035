#include "scene/sky_irradiance.h"

#include <algorithm>
#include <utility>

namespace beamspread {

namespace {

// Rows of the coarsest level, all of whose parts are visited. More: slower where most of the light comes from few parts.
constexpr std::size_t coarsest_rows = 8;

// Light times reach, as a fraction of all light, below which a part that the horizon crosses is not divided. Larger: faster,
// and less exact: here 5e-4 at most, and 1e-4 on average.
constexpr double small_fraction = 1e-4;

// Reach along the normal of a square part in which light is even, as a fraction of the reach to its corners.
constexpr double even_reach = 0.7;

SkyPart joined(const std::array<const SkyPart*, 4>& parts)
{
    SkyPart sum;
    sum.center = Vec3(0.0);
    for (const SkyPart* part : parts) {
        sum.center += part->center;
        for (std::size_t c = 0; c < 3; ++c) {
            sum.light[c] += part->light[c];
            sum.flow[c] += part->flow[c];
        }
    }
    sum.center = glm::normalize(sum.center);
    for (const SkyPart* part : parts)
        sum.reach = std::max(sum.reach, glm::distance(sum.center, part->center) + part->reach);
    return sum;
}

double mean_light(const SkyPart& part)
{
    return (part.light[0] + part.light[1] + part.light[2]) / 3.0;
}

// Irradiance by light whose cosines are even around their mean: the integral of max(cos, 0).
double crossing(double light, double flow, double reach)
{
    if (!(light > 0.0))
        return 0.0;
    const double mean = flow / light;
    if (mean >= reach)
        return flow;
    return mean > -reach ? light * (mean + reach) * (mean + reach) / (4.0 * reach) : 0.0;
}

}  // namespace

SkyIrradiance::SkyIrradiance(std::vector<SkyPart> finest, std::size_t width)
{
    m_levels.push_back({width, std::move(finest)});
    for (const SkyPart& part : m_levels.front().parts)
        m_small += small_fraction * mean_light(part);
    while (m_levels.back().parts.size() / m_levels.back().width > coarsest_rows) {
        const Level& fine = m_levels.back();
        Level level{fine.width / 2, {}};
        for (std::size_t y = 0; y < fine.parts.size() / fine.width; y += 2)
            for (std::size_t x = 0; x < fine.width; x += 2) {
                const SkyPart* const part = &fine.parts[y * fine.width + x];
                level.parts.push_back(joined({part, part + 1, part + fine.width, part + fine.width + 1}));
            }
        m_levels.push_back(std::move(level));
    }
}

Vec3 SkyIrradiance::at(const Vec3& normal) const
{
    Vec3 sum(0.0);
    const Level& coarsest = m_levels.back();
    for (std::size_t i = 0; i < coarsest.parts.size(); ++i)
        add(normal, m_levels.size() - 1, i % coarsest.width, i / coarsest.width, sum);
    return sum;
}

void SkyIrradiance::add(const Vec3& normal, std::size_t level, std::size_t x, std::size_t y, Vec3& sum) const
{
    const SkyPart& part = m_levels[level].parts[y * m_levels[level].width + x];
    const double cosine = glm::dot(normal, part.center);
    if (cosine <= -part.reach)
        return;
    if (cosine >= part.reach) {
        for (int c = 0; c < 3; ++c)
            sum[c] += glm::dot(normal, part.flow[static_cast<std::size_t>(c)]);
        return;
    }
    if (level > 0 && mean_light(part) * part.reach > m_small) {
        for (std::size_t i = 0; i < 4; ++i)
            add(normal, level - 1, 2 * x + i % 2, 2 * y + i / 2, sum);
        return;
    }
    for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        sum[c] += crossing(part.light[channel], glm::dot(normal, part.flow[channel]), even_reach * part.reach);
    }
}

}  // namespace beamspread
