#include "scene/sun_light.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

double half_sine_squared(double angle)
{
    if (!(angle >= 0.0 && angle <= detail::max_angle))
        reject("angle", angle, "0 <= angle <= pi, the full angle in radians");
    const double sine = std::sin(std::min(0.5 * angle, 0.5 * pi));
    return sine * sine;
}

}  // namespace

SunLight::SunLight(const Vec3& direction, double angle, SunDisk disk)
    : m_travel(detail::unit_vector("direction", direction)),
      m_angle(angle),
      m_sin_squared(half_sine_squared(angle)),
      m_cone(-m_travel, m_sin_squared),
      m_disk(disk)
{
}

std::optional<LightSource> SunLight::source() const
{
    if (m_angle > max_parallel_angle)
        return std::nullopt;
    return LightSource{.position = -m_travel, .is_far = true};
}

LightRay SunLight::ray(const Vec2& place) const
{
    constexpr double distance = std::numeric_limits<double>::infinity();
    if (m_disk == SunDisk::flat) {
        const double radius_squared = m_sin_squared / std::max(1.0 - m_sin_squared, 1e-30);
        return {.travel = -m_cone.tangent(place, radius_squared), .distance = distance, .flux = Vec3f(1.0f)};
    }
    // The radiance 1 / (pi sin^2) times the solid angle of the disk.
    const double flux = 2.0 / (1.0 + std::sqrt(1.0 - m_sin_squared));
    double along = 0.0;
    return {.travel = -m_cone.direction(place, along), .distance = distance, .flux = Vec3f(static_cast<float>(flux))};
}

void SunLight::sample(std::span<const Vec3> points, const Vec3& /*normal*/, std::span<const Vec2> square,
                      LightRay* rays) const
{
    if (is_delta())
        std::fill_n(
            rays, points.size(),
            LightRay{.travel = m_travel, .distance = std::numeric_limits<double>::infinity(), .flux = Vec3f(1.0f)});
    else
        std::ranges::transform(square, rays, [this](const Vec2& place) { return ray(place); });
}

Vec3 SunLight::irradiance(const Vec3& /*point*/, const Vec3& normal) const
{
    if (is_delta())
        return Vec3(std::max(-glm::dot(m_travel, normal), 0.0));
    if (m_disk == SunDisk::even)
        return Vec3(m_cone.irradiance(normal) / (pi * m_sin_squared));
    // A plane needs this value once. The sum over 256 x 256 rays is right to 7e-8 and takes a millisecond.
    constexpr int steps = 256;
    double sum = 0.0;
    for (int y = 0; y < steps; ++y)
        for (int x = 0; x < steps; ++x)
            sum += std::max(-glm::dot(ray(Vec2(x + 0.5, y + 0.5) / double{steps}).travel, normal), 0.0);
    return Vec3(sum / (steps * steps));
}

}  // namespace beamspread
