#include "scene/point_light.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "scene/checks.h"

namespace beamspread {

PointLight::PointLight(const Vec3& position, double radius, BallShape shape)
    : m_position(position), m_radius(radius), m_shape(shape)
{
    detail::check_finite("position", position);
    detail::check_length("radius", radius);
}

std::optional<LightSource> PointLight::source() const
{
    if (!is_delta())
        return std::nullopt;
    return LightSource{.position = m_position, .is_smooth = true};
}

std::vector<LightSource> PointLight::corners() const
{
    return box_corners(m_position - m_radius, m_position + m_radius);
}

bool PointLight::is_inside(const Vec3& point) const
{
    const Vec3 way = m_position - point;
    return m_radius > 0.0 && m_shape == BallShape::sphere && glm::dot(way, way) <= m_radius * m_radius;
}

Cone PointLight::seen_from(const Vec3& point) const
{
    const Vec3 way = m_position - point;
    const double distance_squared = glm::dot(way, way);
    const double radius_squared = m_radius * m_radius;
    const double hypotenuse_squared = distance_squared + (m_shape == BallShape::disk ? radius_squared : 0.0);
    return {way / std::sqrt(distance_squared), radius_squared / hypotenuse_squared};
}

void PointLight::sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                        LightRay* rays) const
{
    if (is_delta()) {
        for (const Vec3& point : points) {
            const Vec3 way = point - m_position;
            const double distance = glm::length(way);
            const double inverse = 1.0 / distance;
            const double flux = 0.25 * inv_pi * inverse * inverse;
            *rays++ = {.travel = way * inverse, .distance = distance, .flux = Vec3f(static_cast<float>(flux))};
        }
        return;
    }
    for (std::size_t i = 0; i < points.size(); ++i)
        rays[i] = is_inside(points[i]) ? ray_inside(points[i], normal, square[i]) : ray_outside(points[i], square[i]);
}

LightRay PointLight::ray_inside(const Vec3& point, const Vec3& normal, const Vec2& place) const
{
    const Vec3 way = m_position - point;
    const double radius_squared = m_radius * m_radius;
    const Vec3 local = cosine_hemisphere(place);
    const Vec3 direction = Frame(normal).to_world(local);
    const double along = glm::dot(way, direction);
    const double root = std::sqrt(std::max(along * along - glm::dot(way, way) + radius_squared, 0.0));
    return {.travel = -direction,
            .distance = along + root,
            .flux = Vec3f(static_cast<float>(0.25 * inv_pi / (radius_squared * local.z)))};
}

LightRay PointLight::ray_outside(const Vec3& point, const Vec2& place) const
{
    const Vec3 way = m_position - point;
    const double distance_squared = glm::dot(way, way);
    const double distance = std::sqrt(distance_squared);
    const double radius_squared = m_radius * m_radius;
    double along = 0.0;
    const Vec3 direction = seen_from(point).direction(place, along);
    // Radiance times solid angle, without the radius in the denominator.
    const bool is_disk = m_shape == BallShape::disk;
    const double hypotenuse_squared = distance_squared + (is_disk ? radius_squared : 0.0);
    const double cos_half = std::sqrt(std::max(1.0 - radius_squared / hypotenuse_squared, 0.0));
    const double flux = 0.5 * inv_pi / (hypotenuse_squared * (1.0 + cos_half));
    const double across_squared = distance_squared * (1.0 - along * along);
    const double root = std::sqrt(std::max(radius_squared - across_squared, 0.0));
    return {.travel = -direction,
            .distance = is_disk ? distance / along : distance * along - root,
            .flux = Vec3f(static_cast<float>(flux))};
}

Vec3 PointLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    if (is_inside(point))
        return Vec3(0.25 * inv_pi / (m_radius * m_radius));
    if (!is_delta())
        return Vec3(0.25 * inv_pi * inv_pi * seen_from(point).irradiance(normal) / (m_radius * m_radius));
    const Vec3 way = m_position - point;
    const double distance_squared = glm::dot(way, way);
    const double cos_theta = std::max(glm::dot(way, normal) / std::sqrt(distance_squared), 0.0);
    return Vec3(0.25 * inv_pi * cos_theta / distance_squared);
}

}  // namespace beamspread
