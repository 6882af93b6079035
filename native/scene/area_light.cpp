#include "scene/area_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/constants.h"
#include "base/error.h"
#include "scene/checks.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

namespace {

// Squared size over squared distance of a lamp below which rays are spread evenly over its area instead of its solid
// angle. Higher values save time and add noise.
constexpr double small = 0.05;

constexpr std::array<Vec2, 4> rectangle = {Vec2(-0.5, -0.5), Vec2(0.5, -0.5), Vec2(0.5, 0.5), Vec2(-0.5, 0.5)};

// Nodes and weights over [0, 1], four Gauss points in each third. They are dense at both ends, where the outline is seen
// along its edge.
struct Node {
    double at;
    double weight;
};

constexpr std::array<Node, 12> make_rule()
{
    std::array<Node, 12> nodes{};
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const std::size_t third = i / 4;
        const double s = (static_cast<double>(third) + 0.5 * (1.0 + gauss_node[i % 4])) / 3.0;
        nodes[i] = {.at = s * s * (3.0 - 2.0 * s), .weight = s * (1.0 - s) * gauss_weight[i % 4]};
    }
    return nodes;
}

constexpr std::array<Node, 12> rule = make_rule();

struct Range {
    double first;
    double last;
};

// The border of a lamp with sides of length 1, seen from a place in its plane.
struct Outline {
    Vec2 from;
    bool is_round;

    // The t >= 0 for which from + t direction lies on the lamp; an empty range ends before it begins.
    Range span(const Vec2& direction) const
    {
        if (is_round) {
            const double a = glm::dot(direction, direction);
            const double b = glm::dot(direction, from);
            const double root = std::sqrt(std::max(b * b - a * (glm::dot(from, from) - 0.25), 0.0));
            return {std::max((-b - root) / a, 0.0), (root - b) / a};
        }
        Range range{0.0, std::numeric_limits<double>::infinity()};
        for (int i = 0; i < 2; ++i) {
            const double begin = (std::copysign(0.5, -direction[i]) - from[i]) / direction[i];
            const double end = (std::copysign(0.5, direction[i]) - from[i]) / direction[i];
            range = {std::max(range.first, begin), std::min(range.last, end)};
        }
        return range;
    }

    // Ranges of the azimuths in which the lamp is seen; the border is smooth within each. The sides have these lengths.
    std::vector<Range> azimuths(const Vec2& lengths) const
    {
        std::vector<Range> pieces;
        const bool is_inside =
            is_round ? glm::dot(from, from) < 0.25 : std::abs(from.x) < 0.5 && std::abs(from.y) < 0.5;
        if (is_round && is_inside) {
            for (int i = 0; i < 4; ++i)
                pieces.push_back({0.5 * pi * i, 0.5 * pi * (i + 1)});
            return pieces;
        }
        // Azimuths count from the direction to the center, so that they don't jump by 2 pi over the lamp.
        const Vec2 ahead = from == Vec2(0.0) ? Vec2(1.0, 0.0) : -from * lengths;
        const double middle = std::atan2(ahead.y, ahead.x);
        const auto azimuth = [&](const Vec2& to) {
            const Vec2 way = to * lengths;
            return middle + std::atan2(ahead.x * way.y - ahead.y * way.x, glm::dot(ahead, way));
        };
        if (is_round) {
            // Tangents of the circle of radius 1/2.
            const double distance = glm::length(from);
            const double sine = std::min(0.5 / distance, 1.0);
            const Vec2 x = -from / distance * std::sqrt(1.0 - sine * sine);
            const Vec2 y = Vec2(from.y, -from.x) / distance * sine;
            return {{azimuth(x - y), azimuth(x + y)}};
        }
        std::array<double, 4> corners;
        for (std::size_t i = 0; i < 4; ++i)
            corners[i] = azimuth(rectangle[i] - from);
        std::ranges::sort(corners);
        for (std::size_t i = 0; i < 3; ++i)
            pieces.push_back({corners[i], corners[i + 1]});
        if (is_inside)
            pieces.push_back({corners[3], corners[0] + 2.0 * pi});
        return pieces;
    }
};

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
    detail::check_finite("position", position);
    for (int i = 0; i < 3; ++i)
        detail::check_finite("frame", lamp_to_world[i], "finite axes");
    detail::check_length("size_x", size_x, "a finite length >= 0");
    detail::check_length("size_y", size_y, "a finite length >= 0");
    if (!(spread >= 0.0 && spread <= detail::max_angle))
        reject("spread", spread, "0 <= spread <= pi, the full angle in radians");
    if (!detail::is_finite(m_axis))
        m_radiance = 0.0;
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

void AreaLight::sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                       LightRay* rays) const
{
    for (std::size_t i = 0; i < points.size(); ++i)
        rays[i] = ray_from(points[i], normal, square[i]);
}

LightRay AreaLight::ray_from(const Vec3& point, const Vec3& normal, const Vec2& at) const
{
    const double to_plane = depth(point);
    Part part;
    if (!lit_part(point, to_plane, part))
        return {.travel = -normal, .distance = 1.0, .flux = Vec3f(0.0f)};
    if (m_half_spread == 0.0) {
        // The limit of a dense grid: all light leaves along the axis.
        const double flux = is_on(part.low) ? pi * m_radiance : 0.0;
        return {.travel = m_axis, .distance = to_plane, .flux = Vec3f(static_cast<float>(flux))};
    }
    const Vec2 size = part.high - part.low;
    const Vec3 corner = m_position - point + part.low.x * m_side_x + part.low.y * m_side_y;
    const Vec3 side_x = size.x * m_side_x;
    const Vec3 side_y = size.y * m_side_y;
    const Vec3 middle = corner + 0.5 * (side_x + side_y);
    if (glm::dot(side_x, side_x) + glm::dot(side_y, side_y) >= small * glm::dot(middle, middle)) {
        const SphericalRectangle seen(corner, side_x, side_y);
        const Vec3 way = seen.point(at);
        return ray(way, foot(point + way), seen.solid_angle());
    }
    const bool is_whole = size.x == 1.0 && size.y == 1.0;
    Vec2 place = part.low + at * size;
    double area = size.x * size.y * glm::length(m_side_x) * glm::length(m_side_y);
    if (m_is_round && is_whole) {
        const double radius = 0.5 * std::sqrt(at.x);
        place = {radius * std::cos(2.0 * pi * at.y), radius * std::sin(2.0 * pi * at.y)};
        area = m_area;
    }
    const Vec3 way = m_position - point + place.x * m_side_x + place.y * m_side_y;
    const double squared = glm::dot(way, way);
    return ray(way, place, area * to_plane / (squared * std::sqrt(squared)));
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
    if (m_half_spread >= 0.5 * pi && !m_is_round) {
        std::array<Vec3, 4> corners;
        for (std::size_t i = 0; i < 4; ++i)
            corners[i] = m_position - point + rectangle[i].x * m_side_x + rectangle[i].y * m_side_y;
        return Vec3(m_radiance * polygon_irradiance(corners, normal));
    }
    if (m_half_spread == 0.0)
        return Vec3(is_on(part.low) ? pi * m_radiance * std::max(-glm::dot(m_axis, normal), 0.0) : 0.0);
    return Vec3(m_radiance * seen(point, normal, to_plane));
}

std::vector<LightSource> AreaLight::corners() const
{
    std::vector<LightSource> corners;
    for (const Vec2& place : rectangle)
        corners.push_back({.position = m_position + place.x * m_side_x + place.y * m_side_y});
    return corners;
}

double AreaLight::distance_from(const Vec3& point) const
{
    return glm::distance(point, m_position) - 0.5 * (glm::length(m_side_x) + glm::length(m_side_y));
}

double AreaLight::up_to(double along, double across, double tangent) const
{
    const double angle = std::atan(tangent);
    const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
    const double sine = std::isinf(tangent) ? 1.0 : tangent * cosine;
    const double sin_cos = 0.5 * sine * sine;                   // integrals from 0 of sin cos,
    const double sin_sin = 0.5 * (angle - sine * cosine);       // sin^2
    const double open = along * sin_cos + across * sin_sin;
    if (m_half_spread >= 0.5 * pi)
        return open;
    const double sin_sin_tan = 0.5 * std::log1p(tangent * tangent) - sin_cos;  // and sin^2 tan
    return (m_tan_spread * open - along * sin_sin - across * sin_sin_tan) / (m_tan_spread - m_half_spread);
}

double AreaLight::seen(const Vec3& point, const Vec3& normal, double depth) const
{
    // Coordinates are the angle a to the lamp's axis and the azimuth phi around the foot of the point on the lamp. The
    // lamp is convex: it spans one range of angles for each azimuth, and the integral over that range is known.
    const Vec2 lengths(glm::length(m_side_x), glm::length(m_side_y));
    const double along = -glm::dot(normal, m_axis);  // cos(theta) = along cos(a) + across(phi) sin(a)
    const double across_x = glm::dot(normal, m_side_x) / lengths.x;
    const double across_y = glm::dot(normal, m_side_y) / lengths.y;
    const Outline outline{.from = foot(point), .is_round = m_is_round};
    const double reach = m_half_spread >= 0.5 * pi ? std::numeric_limits<double>::infinity() : depth * m_tan_spread;

    double sum = 0.0;
    for (const auto& [first, last] : outline.azimuths(lengths)) {
        for (const auto& [at, weight] : rule) {
            const double azimuth = std::lerp(first, last, at);
            const Vec2 direction(std::cos(azimuth), std::sin(azimuth));
            auto [near, far] = outline.span(direction / lengths);
            const double across = across_x * direction.x + across_y * direction.y;
            far = std::min(far, reach);
            // The horizon: along depth + across rho changes its sign.
            if (across != 0.0) {
                const double horizon = -along * depth / across;
                (across > 0.0 ? near : far) = across > 0.0 ? std::max(near, horizon) : std::min(far, horizon);
            } else if (along <= 0.0) {
                continue;
            }
            if (near < far) {
                const double light = up_to(along, across, far / depth) - up_to(along, across, near / depth);
                sum += weight * (last - first) * light;
            }
        }
    }
    return sum;
}

}  // namespace beamspread
