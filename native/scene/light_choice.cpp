#include "scene/light_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/constants.h"
#include "scene/shadow_ray.h"

namespace beamspread {

namespace {

// Number of candidates among which a shadow ray is chosen. More make better choices and take time.
constexpr std::size_t max_candidates = 8;

// Candidates of each of few lights of a size, if there are not more than `max_candidates` in all.
constexpr std::size_t max_of_each = 4;

// Of the candidates of the sky, those that the guide chooses; the others find light that it does not know.
constexpr std::size_t guided = 3;
constexpr std::size_t unguided = 1;

// Part of the probability that lights share evenly, so that none is excluded.
constexpr double even_share = 0.1;

// Factor of the chance of directions from which the guide has found no light.
constexpr float unknown_factor = 0.1f;

float mean(const Vec3f& color)
{
    return (color.x + color.y + color.z) / 3.0f;
}

// Above the triangle of the point, which lies behind rays that start there, and with it the light that it gives.
Vec3 start_of(const ShadingPoint& point)
{
    return point.position + point.normal * point.rounding;
}

ShadowRay shadow_ray(const ShadingPoint& point, const LightRay& ray)
{
    return {.origin = start_of(point), .direction = -ray.travel, .distance = ray.distance - point.rounding};
}

}  // namespace

// Keeps one of the candidates in proportion to its weight.
class LightChoice::Reservoir {
public:
    // `samples` is the expected number of such candidates, `factor` > 0 an estimate of visibility.
    void offer(const Candidate& next, float samples, float factor, Random& random)
    {
        const float weight = mean(next.radiance) / samples * factor;
        if (!(weight > 0.0f))
            return;
        m_sum += weight;
        if (m_sum == weight || random.uniform() * static_cast<double>(m_sum) < static_cast<double>(weight)) {
            m_kept = next;
            m_scale = 1.0f / (samples * weight);
        }
    }

    bool is_empty() const { return !(m_sum > 0.0f); }
    const Candidate& kept() const { return m_kept; }
    // Factor of the light of the one that was kept.
    float scale() const { return m_scale * m_sum; }

private:
    Candidate m_kept;
    float m_scale = 0.0f;
    float m_sum = 0.0f;
};

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
        m_distant.push_back(m_lights.back().light->as_distant());
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
        for (const ShadingPoint& point : points) {
            const float seen = m_guide ? visibility(m_guide->cell(point.position), i) : 1.0f;
            light[i] += static_cast<double>(mean(candidate(i, point, random).radiance) * seen);
        }
        all += light[i];
    }
    if (!(all > 0.0))
        return;
    const double even = even_share / static_cast<double>(m_lights.size());
    for (std::size_t i = 0; i < m_lights.size(); ++i)
        m_cumulated[i + 1] = m_cumulated[i] + (1.0 - even_share) * light[i] / all + even;
}

float LightChoice::visibility(std::uint32_t cell, std::size_t light) const
{
    return m_guide ? m_guide->visibility(cell, static_cast<std::uint32_t>(light)) : 1.0f;
}

LightChoice::Candidate LightChoice::with_radiance(std::size_t light, const ShadingPoint& point,
                                                  const LightRay& ray) const
{
    Candidate result{.ray = ray, .light = light};
    const double cosine = -glm::dot(ray.travel, point.normal);
    if (!(cosine > min_cos_theta && ray.distance > 0.0))
        return result;
    const Vec3f irradiance = m_lights[light].color * ray.flux * static_cast<float>(cosine);
    const Vec3f radiance = irradiance * point.bsdf.value(-ray.travel) * static_cast<float>(inv_pi);
    // A point inside a lamp without a size has no direction to it.
    if (std::isfinite(mean(radiance))) {
        result.radiance = radiance;
        result.glow = mean(m_lights[light].color * ray.flux);
    }
    return result;
}

LightChoice::Candidate LightChoice::candidate(std::size_t light, const ShadingPoint& point, Random& random) const
{
    Vec2 place(0.5);
    if (!m_lights[light].light->is_delta()) {
        place.x = random.uniform();
        place.y = random.uniform();
    }
    LightRay ray;
    const Vec3 start = start_of(point);
    m_lights[light].light->sample({&start, 1}, point.normal, {&place, 1}, &ray);
    return with_radiance(light, point, ray);
}

void LightChoice::offer_guided(std::size_t light, const ShadingPoint& point, std::uint32_t cell, Reservoir& reservoir,
                               Random& random) const
{
    // Multiple importance sampling by the balance heuristic (Veach 1997, section 9.2.2).
    const DistantLight& sky = *m_distant[light];
    for (std::size_t i = 0; i < guided + unguided; ++i) {
        const double x = random.uniform();
        const Vec2 place(x, random.uniform());
        Vec3 direction;
        if (i < guided) {
            direction = m_guide->sample(cell, place);
        } else {
            LightRay ray;
            sky.sample({&point.position, 1}, point.normal, {&place, 1}, &ray);
            direction = -ray.travel;
        }
        // Much of what is drawn lies behind the surface and costs no more than this.
        if (!(glm::dot(direction, point.normal) > min_cos_theta))
            continue;
        const std::uint32_t bin = BounceGuide::bin(direction);
        const DistantLight::Seen seen = sky.seen(direction);
        const double density = guided * m_guide->density(cell, bin) + unguided * seen.density;
        if (!(density > 0.0))
            continue;
        const LightRay ray{.travel = -direction,
                           .distance = std::numeric_limits<double>::infinity(),
                           .flux = seen.radiance / static_cast<float>(density)};
        const bool is_known = m_guide->probability(cell, bin) > 0.0f;
        reservoir.offer(with_radiance(light, point, ray), 1.0f, is_known ? 1.0f : unknown_factor, random);
    }
}

void LightChoice::offer_few(const ShadingPoint& point, std::uint32_t cell, Reservoir& reservoir, Random& random) const
{
    const std::size_t most = std::clamp<std::size_t>(max_candidates / m_lights.size(), 1, max_of_each);
    for (std::size_t light = 0; light < m_lights.size(); ++light) {
        if (m_distant[light] && m_guide && m_guide->knows(cell)) {
            offer_guided(light, point, cell, reservoir, random);
            continue;
        }
        const std::size_t rays = m_lights[light].light->is_delta() ? 1 : most;
        for (std::size_t k = 0; k < rays; ++k)
            reservoir.offer(candidate(light, point, random), static_cast<float>(rays), visibility(cell, light), random);
    }
}

void LightChoice::offer_many(const ShadingPoint& point, std::uint32_t cell, Reservoir& reservoir, Random& random) const
{
    // The sky is no matter of choice; other lights are drawn in strata of their distribution.
    for (std::size_t light = 0; light < m_lights.size(); ++light)
        if (m_distant[light] && m_guide && m_guide->knows(cell))
            offer_guided(light, point, cell, reservoir, random);
    for (std::size_t k = 0; k < max_candidates; ++k) {
        const double at =
            (static_cast<double>(k) + random.uniform()) / static_cast<double>(max_candidates) * m_cumulated.back();
        const auto above = std::upper_bound(m_cumulated.begin() + 1, m_cumulated.end() - 1, at);
        const auto light = static_cast<std::size_t>(above - m_cumulated.begin()) - 1;
        if (m_distant[light] && m_guide && m_guide->knows(cell))
            continue;
        const double part = (m_cumulated[light + 1] - m_cumulated[light]) / m_cumulated.back();
        reservoir.offer(candidate(light, point, random), static_cast<float>(part * static_cast<double>(max_candidates)),
                        visibility(cell, light), random);
    }
}

LitRay LightChoice::choose(const ShadingPoint& point, Random& random) const
{
    const std::uint32_t cell = m_guide ? m_guide->cell(point.position) : 0;
    Reservoir reservoir;
    if (m_lights.size() <= max_candidates)
        offer_few(point, cell, reservoir, random);
    else
        offer_many(point, cell, reservoir, random);
    if (reservoir.is_empty())
        return {};
    const Candidate& kept = reservoir.kept();
    LitRay chosen{.shadow_ray = shadow_ray(point, kept.ray),
                  .radiance = kept.radiance * reservoir.scale(),
                  .occluders = m_lights[kept.light].occluders};
    if (m_guide)
        chosen.record = {.cell = cell,
                         .light = static_cast<std::uint32_t>(kept.light),
                         .bin = BounceGuide::bin(chosen.shadow_ray.direction),
                         .radiance = m_distant[kept.light] ? kept.glow * reservoir.scale() : 0.0f};
    return chosen;
}

}  // namespace beamspread
