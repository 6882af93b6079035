#include "scene/sun_light.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

// Nodes of a table over the angles at which the horizon cuts the disk, and rays along a side of each. More: irradiance
// there is right to less than 3e-5 of that at normal incidence.
constexpr int table_nodes = 128;
constexpr int table_steps = 128;

// A flat disk whose irradiance for any normal takes no sum over rays: light above the horizon is in proportion to the
// cosine, and a table tells the rest.
class TabulatedSun final : public Light {
public:
    TabulatedSun(const SunLight& sun, const Vec3& toward, double sine) : m_sun(sun), m_toward(toward), m_sine(sine)
    {
        const Frame frame(toward);
        std::vector<Vec3> points(table_steps);
        std::vector<Vec2> places(points.size());
        std::vector<LightRay> rays(points.size());
        m_table.assign(table_nodes + 1, 0.0);
        for (int y = 0; y < table_steps; ++y) {
            for (int x = 0; x < table_steps; ++x)
                places[static_cast<std::size_t>(x)] = Vec2(x + 0.5, y + 0.5) / double{table_steps};
            sun.sample(points, toward, places, rays.data());
            for (const LightRay& ray : rays) {
                m_straight_on -= glm::dot(ray.travel, toward);
                for (int node = 0; node <= table_nodes; ++node) {
                    const double cosine = sine * (2.0 * node / table_nodes - 1.0);
                    const Vec3 normal = toward * cosine + frame.x * std::sqrt(1.0 - cosine * cosine);
                    m_table[static_cast<std::size_t>(node)] += std::max(-glm::dot(ray.travel, normal), 0.0);
                }
            }
        }
        constexpr double all = double{table_steps} * table_steps;
        m_straight_on /= all;
        for (double& value : m_table)
            value /= all;
    }

    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override
    {
        m_sun.sample(points, normal, square, rays);
    }

    Vec3 irradiance(const Vec3& /*point*/, const Vec3& normal) const override
    {
        const double cosine = glm::dot(m_toward, normal);
        if (cosine >= m_sine)
            return Vec3(cosine * m_straight_on);
        if (cosine <= -m_sine)
            return Vec3(0.0);
        const double at = 0.5 * (cosine / m_sine + 1.0) * table_nodes;
        const auto node = std::min(static_cast<std::size_t>(at), std::size_t{table_nodes - 1});
        const double part = at - static_cast<double>(node);
        return Vec3(m_table[node] * (1.0 - part) + m_table[node + 1] * part);
    }

    std::optional<LightSource> source() const override { return m_sun.source(); }
    std::vector<LightSource> corners() const override { return m_sun.corners(); }

private:
    const SunLight& m_sun;
    Vec3 m_toward;
    double m_sine;  // of half the angle
    double m_straight_on = 0.0;
    std::vector<double> m_table;  // over the cosine of the normal to the disk's center, from -m_sine to m_sine
};

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

std::vector<LightSource> SunLight::corners() const
{
    // Beside a disk of half the angle 45 degrees a pyramid becomes wide.
    if (m_sin_squared > 0.5)
        return {};
    const double tangent = std::sqrt(m_sin_squared / (1.0 - m_sin_squared));
    const Frame frame(-m_travel);
    std::vector<LightSource> corners;
    for (const double x : {-tangent, tangent})
        for (const double y : {-tangent, tangent})
            corners.push_back({.position = frame.to_world({x, y, 1.0}), .is_far = true});
    return corners;
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

std::shared_ptr<const Light> SunLight::facing_all() const
{
    if (is_delta() || m_disk == SunDisk::even)
        return nullptr;
    return std::make_shared<TabulatedSun>(*this, -m_travel, std::sqrt(m_sin_squared));
}

}  // namespace beamspread
