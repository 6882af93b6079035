#include "scene/light_choice.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "scene/shadow_ray.h"

namespace beamspread {

namespace {

// Number of candidates among which a shadow ray is chosen. More make better choices and take time.
constexpr std::size_t max_candidates = 8;

// Part of the probability that lights share evenly, so that none is excluded.
constexpr double even_share = 0.1;

float mean(const Vec3f& color)
{
    return (color.x + color.y + color.z) / 3.0f;
}

ShadowRay shadow_ray(const ShadingPoint& point, const LightRay& ray)
{
    const Vec3 lift = point.normal * point.rounding;
    if (std::isinf(ray.distance))
        return {.origin = point.position + lift, .direction = -ray.travel, .distance = ray.distance};
    const Vec3 way = -ray.travel * ray.distance - lift;
    const double length = glm::length(way);
    return {.origin = point.position + lift, .direction = way / length, .distance = length - point.rounding};
}

}  // namespace

LightChoice::LightChoice(std::span<const SceneLight> lights)
{
    for (const SceneLight& light : lights) {
        if (light.color == Vec3f(0.0f))
            continue;
        m_lights.push_back(light);
        if (auto prepared = light.light->facing_all()) {
            m_lights.back().light = prepared.get();
            m_prepared.push_back(std::move(prepared));
        }
    }
    const auto count = static_cast<double>(m_lights.size());
    for (std::size_t i = 0; i <= m_lights.size(); ++i)
        m_cumulated.push_back(static_cast<double>(i) / count);
}

void LightChoice::learn(std::span<const ShadingPoint> points, Random& random)
{
    if (m_lights.size() <= max_candidates || points.empty())
        return;
    std::vector<double> light(m_lights.size());
    double all = 0.0;
    for (std::size_t i = 0; i < m_lights.size(); ++i) {
        for (const ShadingPoint& point : points)
            light[i] += static_cast<double>(mean(candidate(i, point, random).radiance));
        all += light[i];
    }
    if (!(all > 0.0))
        return;
    const double even = even_share / static_cast<double>(m_lights.size());
    for (std::size_t i = 0; i < m_lights.size(); ++i)
        m_cumulated[i + 1] = m_cumulated[i] + (1.0 - even_share) * light[i] / all + even;
}

LightChoice::Candidate LightChoice::candidate(std::size_t index, const ShadingPoint& point, Random& random) const
{
    const SceneLight& light = m_lights[index];
    Candidate result;
    Vec2 place(0.5);
    if (!light.light->is_delta()) {
        place.x = random.uniform();
        place.y = random.uniform();
    }
    light.light->sample({&point.position, 1}, point.normal, {&place, 1}, &result.ray);
    const double cosine = -glm::dot(result.ray.travel, point.normal);
    if (!(cosine > min_cos_theta && result.ray.distance > 0.0))
        return result;
    const Vec3f irradiance = light.color * result.ray.flux * static_cast<float>(cosine);
    const Vec3f radiance = irradiance * point.bsdf.value(-result.ray.travel) * static_cast<float>(inv_pi);
    // A point inside a lamp without a size has no direction to it.
    if (std::isfinite(mean(radiance)))
        result.radiance = radiance;
    return result;
}

LitRay LightChoice::choose(const ShadingPoint& point, Random& random) const
{
    const std::size_t count = m_lights.size();
    const bool is_few = count <= max_candidates;
    // Each of few lights gives as many candidates.
    const std::size_t of_each =
        is_few ? std::max<std::size_t>(max_candidates / 2 / std::max<std::size_t>(count, 1), 1) : 1;
    LitRay chosen;
    Candidate kept;
    float kept_weight = 0.0f;
    float sum = 0.0f;
    const auto offer = [&](std::size_t light, double probability) {
        const Candidate next = candidate(light, point, random);
        const float weight = mean(next.radiance) / static_cast<float>(probability);
        if (!(weight > 0.0f))
            return;
        sum += weight;
        // Reservoir sampling keeps one candidate in proportion to its weight.
        if (sum == weight || random.uniform() * static_cast<double>(sum) < static_cast<double>(weight)) {
            kept = next;
            kept_weight = mean(next.radiance);
            chosen.occluders = m_lights[light].occluders;
        }
    };
    if (is_few) {
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t rays = m_lights[i].light->is_delta() ? 1 : of_each;
            for (std::size_t k = 0; k < rays; ++k)
                offer(i, static_cast<double>(rays));
        }
    } else {
        // Stratified draws from the distribution.
        for (std::size_t k = 0; k < max_candidates; ++k) {
            const double at =
                (static_cast<double>(k) + random.uniform()) / static_cast<double>(max_candidates) * m_cumulated.back();
            const auto above = std::upper_bound(m_cumulated.begin() + 1, m_cumulated.end() - 1, at);
            const auto light = static_cast<std::size_t>(above - m_cumulated.begin()) - 1;
            const double part = (m_cumulated[light + 1] - m_cumulated[light]) / m_cumulated.back();
            offer(light, part * static_cast<double>(max_candidates));
        }
    }
    if (kept_weight > 0.0f) {
        chosen.radiance = kept.radiance * (sum / kept_weight);
        chosen.shadow_ray = shadow_ray(point, kept.ray);
    }
    return chosen;
}

}  // namespace beamspread
