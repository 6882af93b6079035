#include "scene/sphere_light.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "scene/checks.h"
#include "scene/cone.h"

namespace beamspread {

SphereLight::SphereLight(const Vec3& position, double radius, SphereModel model)
    : m_position(position), m_radius(radius), m_model(model)
{
    detail::check_finite("position", position);
    detail::check_length("radius", radius);
}

bool SphereLight::is_inside(const Vec3& point) const
{
    const Vec3 way = m_position - point;
    return m_model == SphereModel::sphere && glm::dot(way, way) <= m_radius * m_radius;
}

Cone SphereLight::seen_from(const Vec3& point) const
{
    const Vec3 away = m_position - point;
    const double distance_squared = glm::dot(away, away);
    const double radius_squared = m_radius * m_radius;
    const double hypotenuse_squared =
        m_model == SphereModel::disk ? distance_squared + radius_squared : distance_squared;
    return {away / std::sqrt(distance_squared), radius_squared / hypotenuse_squared};
}

void SphereLight::sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const
{
    const Vec3 away = m_position - point;
    const double distance_squared = glm::dot(away, away);
    const double radius_squared = m_radius * m_radius;
    if (is_inside(point)) {
        const Frame frame(normal);
        for (const Vec2& place : square) {
            const Vec3 local = cosine_hemisphere(place);
            const Vec3 direction = frame.to_world(local);
            const double along = glm::dot(away, direction);
            const double distance = along + std::sqrt(std::max(along * along - distance_squared + radius_squared, 0.0));
            *rays++ = {.travel = -direction,
                       .distance = distance,
                       .flux = Vec3f(static_cast<float>(0.25 * inv_pi / (radius_squared * local.z)))};
        }
        return;
    }
    const Cone seen = seen_from(point);
    const double distance = std::sqrt(distance_squared);
    // Radiance times solid angle, in a form that holds for a radius of 0 too.
    const double hypotenuse_squared =
        m_model == SphereModel::disk ? distance_squared + radius_squared : distance_squared;
    const double cos_half = std::sqrt(std::max(1.0 - radius_squared / hypotenuse_squared, 0.0));
    const Vec3f flux(static_cast<float>(0.5 * inv_pi / (hypotenuse_squared * (1.0 + cos_half))));
    for (const Vec2& place : square) {
        double along = 0.0;
        const Vec3 direction = seen.direction(place, along);
        const double across_squared = distance_squared * (1.0 - along * along);
        const double length = m_model == SphereModel::disk
                                  ? distance / along
                                  : distance * along - std::sqrt(std::max(radius_squared - across_squared, 0.0));
        *rays++ = {.travel = -direction, .distance = length, .flux = flux};
    }
}

Vec3 SphereLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    if (is_inside(point))
        return Vec3(0.25 * inv_pi / (m_radius * m_radius));
    const Vec3 away = m_position - point;
    if (m_radius == 0.0) {
        const double distance_squared = glm::dot(away, away);
        const double cos_theta = std::max(glm::dot(away, normal) / std::sqrt(distance_squared), 0.0);
        return Vec3(0.25 * inv_pi * cos_theta / distance_squared);
    }
    return Vec3(0.25 * inv_pi * inv_pi * seen_from(point).irradiance(normal) / (m_radius * m_radius));
}

}  // namespace beamspread
