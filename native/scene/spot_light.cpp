#include "scene/spot_light.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Factor of light from behind inside the ball: Cycles sends a ray there with the same chance as a diffuse surface does,
// and the balance of two equal chances is a half.
constexpr double part_from_behind = 0.5;

// Solid angle of the ball, steradians, above which more rings are summed. Lower values cost time.
constexpr double wide = 1.0;

// Places on the ball's rim that decide whether the falloff changes over the ball. More find narrower cones.
constexpr int rim_places = 8;

double smoothstep(double t)
{
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

}  // namespace

SpotCone::SpotCone(const Mat3& lamp_to_world, double spot_size, double blend, SpotFalloff falloff)
    : m_world_to_lamp(glm::inverse(lamp_to_world)),
      m_cos_half_size(std::cos(0.5 * spot_size)),
      m_smooth((1.0 - m_cos_half_size) * blend),
      m_falloff(falloff)
{
    if (!(spot_size > 0.0 && spot_size <= detail::max_angle))
        reject("spot_size", spot_size, "0 < spot_size <= pi, the full angle in radians");
    if (!(blend >= 0.0 && blend <= 1.0))
        reject("blend", blend, "0 to 1");
    for (int i = 0; i < 3; ++i) {
        if (!detail::is_finite(m_world_to_lamp[i]))
            reject("frame", "singular or not finite", "three axes that span space");
    }
    if (falloff == SpotFalloff::legacy) {
        // Only the last row is used: minus the cosine to the lamp's own z axis.
        const Vec3 z = glm::normalize(lamp_to_world[2]);
        m_world_to_lamp = glm::transpose(Mat3(Vec3(0.0), Vec3(0.0), z));
    }
}

double SpotCone::falloff(const Vec3& travel) const
{
    const Vec3 local = m_world_to_lamp * travel;
    const double cos_theta = m_falloff == SpotFalloff::scaled ? -local.z / glm::length(local) : -local.z;
    // True also for NaN, the cosine of a travel of 0.
    if (!(cos_theta > m_cos_half_size))
        return 0.0;
    const double border = m_smooth > 0.0 ? smoothstep((cos_theta - m_cos_half_size) / m_smooth) : 1.0;
    return m_falloff == SpotFalloff::scaled ? border : border * cos_theta;
}

SpotLight::SpotLight(const Vec3& position, const SpotCone& cone, double radius, BallShape shape)
    : m_ball(position, radius, shape), m_cone(cone)
{
}

std::optional<LightSource> SpotLight::source() const
{
    if (!is_delta())
        return std::nullopt;
    return LightSource{.position = m_ball.position()};
}

void SpotLight::sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                       LightRay* rays) const
{
    m_ball.sample(points, normal, square, rays);
    for (const Vec3& point : points) {
        LightRay& ray = *rays++;
        if (!m_ball.is_inside(point))
            ray.flux *= static_cast<float>(m_cone.falloff(ray.travel));
        else if (glm::dot(ray.travel, outward(point)) <= 0.0)
            ray.flux *= static_cast<float>(part_from_behind);
    }
}

Vec3 SpotLight::outward(const Vec3& point) const
{
    const Vec3 way = point - m_ball.position();
    const double length = glm::length(way);
    return length > 0.0 ? way / length : Vec3(0.0);
}

double SpotLight::mean_falloff(const Vec3& point, const Vec3& normal) const
{
    const Cone seen = m_ball.seen_from(point);
    // The region without falloff is convex: the whole ball lies in it if the ball's rim does.
    double lowest = m_cone.falloff(-seen.axis());
    double highest = lowest;
    for (int i = 0; i < rim_places; ++i) {
        double along = 0.0;
        const double falloff = m_cone.falloff(-seen.direction({1.0, (i + 0.5) / rim_places}, along));
        lowest = std::min(lowest, falloff);
        highest = std::max(highest, falloff);
    }
    if (lowest == 1.0)
        return 1.0;
    // Rings by the Gauss rule: more where the border is hard and where the ball looks wide.
    const int panels = highest - lowest < 0.5 && seen.solid_angle() < wide ? 2 : 8;
    const int azimuths = 8 * panels;
    double sum = 0.0;
    double whole = 0.0;
    for (int panel = 0; panel < panels; ++panel) {
        for (std::size_t node = 0; node < gauss_node.size(); ++node) {
            const double ring = (panel + 0.5 * (1.0 + gauss_node[node])) / panels;
            for (int i = 0; i < azimuths; ++i) {
                double along = 0.0;
                // Each ring is turned against the one before, so that no border runs along the points.
                const double azimuth =
                    (i + 0.618 * static_cast<double>(node + 4 * static_cast<std::size_t>(panel))) / azimuths;
                const Vec3 direction = seen.direction({ring, azimuth}, along);
                const double weight = gauss_weight[node] * std::max(glm::dot(direction, normal), 0.0);
                whole += weight;
                sum += weight * m_cone.falloff(-direction);
            }
        }
    }
    return whole > 0.0 ? sum / whole : 0.0;
}

Vec3 SpotLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    const Vec3 whole = m_ball.irradiance(point, normal);
    if (!(whole.x > 0.0))
        return whole;
    if (is_delta())
        return whole * m_cone.falloff(glm::normalize(point - m_ball.position()));
    if (m_ball.is_inside(point)) {
        // The half-space behind holds this part of even light.
        const double behind = 0.5 + 0.5 * glm::dot(outward(point), normal);
        return whole * (1.0 - (1.0 - part_from_behind) * behind);
    }
    return whole * mean_falloff(point, normal);
}

}  // namespace beamspread
