#include "scene/area_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "base/error.h"
#include "scene/checks.h"
#include "scene/polygon.h"
#include "scene/quadrature.h"

namespace beamspread {

namespace {

// Hosts that keep angles in single precision round pi up.
constexpr double max_spread = static_cast<double>(static_cast<float>(pi));

// A lamp that looks smaller than this, in steradians, is sampled evenly over its area: that is as good and costs less.
constexpr double small_solid_angle = 0.05;

// Corners of the polygon that stands for an ellipse: at a tenth of a circle's radius its light is right to 1e-3.
constexpr int ellipse_corners = 64;

void check_size(const std::string& name, double size)
{
    if (!(size >= 0.0) || std::isinf(size))
        reject(name, size, "a finite length >= 0");
}

}  // namespace

AreaLight::AreaLight(const Vec3& position, const Mat3& lamp_to_world, double size_x, double size_y, bool is_round,
                     double spread)
    : m_position(position),
      m_side_x(lamp_to_world[0] * size_x),
      m_side_y(lamp_to_world[1] * size_y),
      m_axis(-glm::normalize(lamp_to_world[2])),
      m_is_round(is_round),
      m_area(glm::length(m_side_x) * glm::length(m_side_y) * (is_round ? 0.25 * pi : 1.0)),
      m_radiance(m_area > 0.0 ? 0.25 / m_area : 0.0),
      m_half_spread(0.5 * spread),
      m_tan_spread(std::tan(m_half_spread))
{
    if (!detail::is_finite(position))
        reject("position", detail::to_text(position), "finite coordinates in metres");
    for (int i = 0; i < 3; ++i) {
        if (!detail::is_finite(lamp_to_world[i]))
            reject("frame", detail::to_text(lamp_to_world[i]), "finite axes");
    }
    check_size("size_x", size_x);
    check_size("size_y", size_y);
    if (!(spread >= 0.0 && spread <= max_spread))
        reject("spread", spread, "0 <= spread <= pi, the full angle in radians");
    if (!detail::is_finite(m_axis))
        m_radiance = 0.0;
    if (!is_round) {
        for (const Vec2& corner : {Vec2(-0.5, -0.5), Vec2(0.5, -0.5), Vec2(0.5, 0.5), Vec2(-0.5, 0.5)})
            m_border.push_back(m_side_x * corner.x + m_side_y * corner.y);
        return;
    }
    // As large as the ellipse.
    const double step = 2.0 * pi / ellipse_corners;
    const double radius = 0.5 * std::sqrt(step / std::sin(step));
    for (int i = 0; i < ellipse_corners; ++i)
        m_border.push_back(radius * (m_side_x * std::cos(i * step) + m_side_y * std::sin(i * step)));
}

Vec2 AreaLight::foot(const Vec3& point) const
{
    const Vec3 away = point - m_position;
    return {glm::dot(away, m_side_x) / glm::dot(m_side_x, m_side_x),
            glm::dot(away, m_side_y) / glm::dot(m_side_y, m_side_y)};
}

bool AreaLight::lit_part(const Vec3& point, double depth, Part& part) const
{
    if (m_radiance == 0.0 || !(depth > 0.0))
        return false;
    if (m_half_spread >= 0.5 * pi)
        return true;
    const Vec2 middle = foot(point);
    const double radius = depth * m_tan_spread;
    const Vec2 reach(radius / glm::length(m_side_x), radius / glm::length(m_side_y));
    part.low = glm::max(part.low, middle - reach);
    part.high = glm::min(part.high, middle + reach);
    return part.low.x <= part.high.x && part.low.y <= part.high.y;
}

bool AreaLight::is_on(const Vec2& place) const
{
    return !m_is_round || glm::dot(place, place) <= 0.25;
}

double AreaLight::through_grid(double cos_angle) const
{
    if (m_half_spread >= 0.5 * pi)
        return 1.0;
    const double tangent = std::sqrt(std::max(1.0 - cos_angle * cos_angle, 0.0)) / cos_angle;
    return std::max((m_tan_spread - tangent) / (m_tan_spread - m_half_spread), 0.0);
}

void AreaLight::sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const
{
    const double to_plane = depth(point);
    Part part;
    if (!lit_part(point, to_plane, part)) {
        std::fill_n(rays, square.size(), LightRay{.travel = -normal, .distance = 1.0, .flux = Vec3f(0.0f)});
        return;
    }
    if (m_half_spread == 0.0) {
        // The grid's limit: all light that leaves does so along the axis.
        const double flux = is_on(part.low) ? pi * m_radiance : 0.0;
        std::fill_n(rays, square.size(),
                    LightRay{.travel = m_axis, .distance = to_plane, .flux = Vec3f(static_cast<float>(flux))});
        return;
    }
    const Vec2 size = part.high - part.low;
    const Vec3 corner = m_position - point + part.low.x * m_side_x + part.low.y * m_side_y;
    const Vec3 side_x = size.x * m_side_x;
    const Vec3 side_y = size.y * m_side_y;
    const double area = size.x * size.y * glm::length(m_side_x) * glm::length(m_side_y);
    const Vec3 middle = corner + 0.5 * (side_x + side_y);
    const double distance_squared = glm::dot(middle, middle);
    if (area * to_plane < small_solid_angle * distance_squared * std::sqrt(distance_squared)) {
        const bool is_whole = size.x == 1.0 && size.y == 1.0;
        for (const Vec2& at : square) {
            Vec2 place;
            double of_area = area;
            if (m_is_round && is_whole) {
                const double radius = 0.5 * std::sqrt(at.x);
                place = {radius * std::cos(2.0 * pi * at.y), radius * std::sin(2.0 * pi * at.y)};
                of_area = m_area;
            } else {
                place = part.low + at * size;
            }
            const Vec3 way = m_position - point + place.x * m_side_x + place.y * m_side_y;
            const double squared = glm::dot(way, way);
            *rays++ = ray(way, place, of_area * to_plane / (squared * std::sqrt(squared)));
        }
        return;
    }
    const SphericalRectangle seen(corner, side_x, side_y);
    for (const Vec2& at : square) {
        const Vec3 way = seen.point(at);
        *rays++ = ray(way, foot(point + way), seen.solid_angle());
    }
}

LightRay AreaLight::ray(const Vec3& way, const Vec2& place, double solid_angle) const
{
    const double distance = glm::length(way);
    const Vec3 travel = -way / distance;
    const double radiance = is_on(place) ? m_radiance * through_grid(glm::dot(travel, m_axis)) : 0.0;
    return {.travel = travel, .distance = distance, .flux = Vec3f(static_cast<float>(radiance * solid_angle))};
}

Vec3 AreaLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    const double to_plane = depth(point);
    Part part;
    if (!lit_part(point, to_plane, part))
        return Vec3(0.0);
    if (m_half_spread >= 0.5 * pi) {
        std::array<Vec3, ellipse_corners> corners;
        for (std::size_t i = 0; i < m_border.size(); ++i)
            corners[i] = m_position - point + m_border[i];
        return Vec3(m_radiance * polygon_irradiance(std::span(corners).first(m_border.size()), normal));
    }
    if (m_half_spread == 0.0)
        return Vec3(is_on(part.low) ? pi * m_radiance * std::max(-glm::dot(m_axis, normal), 0.0) : 0.0);
    return mean_irradiance(*this, point, normal);
}

}  // namespace beamspread
