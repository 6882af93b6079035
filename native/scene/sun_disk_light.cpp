#include "scene/sun_disk_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/constants.h"
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

SunDiskLight::SunDiskLight(const Vec3& direction, double angle, SunDisk disk)
    : m_sin_squared(half_sine_squared(angle)),
      m_cone(-detail::unit_vector("direction", direction), m_sin_squared),
      m_disk(disk)
{
}

void SunDiskLight::sample(const Vec3& /*point*/, const Vec3& /*normal*/, std::span<const Vec2> square,
                          LightRay* rays) const
{
    // pi sin^2(half angle) of the irradiance at normal incidence is the radiance; here times the solid angle.
    const double even_flux = 2.0 / (1.0 + std::sqrt(1.0 - m_sin_squared));
    const double radius_squared = m_sin_squared / std::max(1.0 - m_sin_squared, 1e-30);
    for (const Vec2& place : square) {
        LightRay& ray = *rays++;
        ray.distance = std::numeric_limits<double>::infinity();
        if (m_disk == SunDisk::even) {
            double along = 0.0;
            ray.travel = -m_cone.direction(place, along);
            ray.flux = Vec3f(static_cast<float>(even_flux));
        } else {
            ray.travel = -m_cone.tangent(place, radius_squared);
            ray.flux = Vec3f(1.0f);
        }
    }
}

Vec3 SunDiskLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    if (m_disk == SunDisk::even) {
        // A cone without width is a direction.
        const double cos_theta = std::max(glm::dot(m_cone.axis(), normal), 0.0);
        return Vec3(m_sin_squared > 0.0 ? m_cone.irradiance(normal) / (pi * m_sin_squared) : cos_theta);
    }
    // Wanted once for a plane: brute force, right to 7e-8 in a millisecond; with 128 steps to 2e-7.
    constexpr int steps = 256;
    double sum = 0.0;
    std::vector<Vec2> square(steps);
    std::vector<LightRay> rays(steps);
    for (int y = 0; y < steps; ++y) {
        for (int x = 0; x < steps; ++x)
            square[static_cast<std::size_t>(x)] = Vec2(x + 0.5, y + 0.5) / static_cast<double>(steps);
        sample(point, normal, square, rays.data());
        for (const LightRay& ray : rays)
            sum += std::max(-glm::dot(ray.travel, normal), 0.0);
    }
    return Vec3(sum / (steps * steps));
}

}  // namespace beamspread
