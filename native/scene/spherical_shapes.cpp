#include "scene/spherical_shapes.h"

#include <algorithm>
#include <cmath>

#include "base/circle.h"
#include "base/constants.h"

namespace beamspread {

namespace {

// The angle between two vectors, times the component along the normal of the unit vector at right angles to both.
double edge(const Vec3& from, const Vec3& to, const Vec3& normal)
{
    const Vec3 across = glm::cross(from, to);
    const double sine = glm::length(across);
    return sine > 0.0 ? std::atan2(sine, glm::dot(from, to)) / sine * glm::dot(across, normal) : 0.0;
}

}  // namespace

Cone::Cone(const Vec3& axis, double sin_squared)
    : m_frame(axis),
      m_sin_squared(sin_squared),
      m_one_minus_cos(sin_squared / (1.0 + std::sqrt(std::max(1.0 - sin_squared, 0.0))))
{
}

double Cone::solid_angle() const
{
    return 2.0 * pi * m_one_minus_cos;
}

Vec3 Cone::direction(const Vec2& place, double& along) const
{
    const double one_minus_cos = place.x * m_one_minus_cos;
    along = 1.0 - one_minus_cos;
    const double across = std::sqrt(one_minus_cos * (1.0 + along));
    return m_frame.to_world(Vec3(across * on_circle(place.y), along));
}

Vec3 Cone::tangent(const Vec2& place, double radius_squared) const
{
    const double across = std::sqrt(place.x * radius_squared);
    return glm::normalize(m_frame.to_world(Vec3(across * on_circle(place.y), 1.0)));
}

// Snyder 1996, "Area light sources for real-time graphics", MSR-TR-96-11: a cone that the horizon cuts.
double Cone::irradiance(const Vec3& normal) const
{
    const double cos_theta = std::clamp(glm::dot(m_frame.z, normal), -1.0, 1.0);
    const double sin_half = std::sqrt(m_sin_squared);
    if (cos_theta >= sin_half)
        return pi * m_sin_squared * cos_theta;
    if (cos_theta <= -sin_half)
        return 0.0;
    const double sin_theta = std::sqrt(1.0 - cos_theta * cos_theta);
    const double cos_half = std::sqrt(std::max(1.0 - m_sin_squared, 0.0));
    const double sin_gamma = std::min(cos_half / sin_theta, 1.0);
    const double cos_gamma = std::sqrt(1.0 - sin_gamma * sin_gamma);
    const double g = -2.0 * sin_theta * cos_half * cos_gamma + 0.5 * pi - std::asin(sin_gamma) + sin_gamma * cos_gamma;
    const double h = cos_theta * (cos_gamma * std::sqrt(std::max(m_sin_squared - cos_gamma * cos_gamma, 0.0)) +
                                  m_sin_squared * std::asin(std::min(cos_gamma / sin_half, 1.0)));
    return cos_theta >= 0.0 ? pi * m_sin_squared * cos_theta + g - h : g + h;
}

Vec3 cosine_hemisphere(const Vec2& place)
{
    return {std::sqrt(place.x) * on_circle(place.y), std::sqrt(1.0 - place.x)};
}

double polygon_irradiance(std::span<const Vec3> corners, const Vec3& normal)
{
    // Each edge is cut where it passes the horizon; the edge that closes the polygon along the horizon follows last.
    double sum = 0.0;
    Vec3 enters(0.0);
    Vec3 leaves(0.0);
    bool is_cut = false;
    Vec3 from = corners.back();
    double from_height = glm::dot(from, normal);
    for (const Vec3& to : corners) {
        const double to_height = glm::dot(to, normal);
        const bool is_from_above = from_height > 0.0;
        const bool is_to_above = to_height > 0.0;
        if (is_from_above && is_to_above) {
            sum += edge(from, to, normal);
        } else if (is_from_above != is_to_above) {
            const Vec3 cut = from + (to - from) * (from_height / (from_height - to_height));
            is_cut = true;
            sum += is_to_above ? edge(cut, to, normal) : edge(from, cut, normal);
            (is_to_above ? enters : leaves) = cut;
        }
        from = to;
        from_height = to_height;
    }
    if (is_cut)
        sum += edge(leaves, enters, normal);
    return 0.5 * std::abs(sum);
}

SphericalRectangle::SphericalRectangle(const Vec3& corner, const Vec3& side_x, const Vec3& side_y)
{
    const double length_x = glm::length(side_x);
    const double length_y = glm::length(side_y);
    m_x = side_x / length_x;
    m_y = side_y / length_y;
    m_z = glm::cross(m_x, m_y);
    m_z0 = glm::dot(corner, m_z);
    if (m_z0 > 0.0) {
        m_z = -m_z;
        m_z0 = -m_z0;
    }
    m_x0 = glm::dot(corner, m_x);
    m_y0 = glm::dot(corner, m_y);
    m_x1 = m_x0 + length_x;
    m_y1 = m_y0 + length_y;

    // z of the unit normals of the planes through the origin and each side.
    const auto normal_z = [this](double at) { return -at / std::sqrt(m_z0 * m_z0 + at * at); };
    const double bottom = normal_z(m_y0);
    const double right = -normal_z(m_x1);
    const double top = -normal_z(m_y1);
    const double left = normal_z(m_x0);
    const auto angle = [](double a, double b) { return std::acos(std::clamp(-a * b, -1.0, 1.0)); };
    m_b0 = bottom;
    m_b1 = top;
    m_k = 2.0 * pi - angle(top, left) - angle(left, bottom);
    m_solid_angle = std::max(angle(bottom, right) + angle(right, top) - m_k, 0.0);
}

Vec3 SphericalRectangle::point(const Vec2& place) const
{
    const double au = place.x * m_solid_angle + m_k;
    const double fu = (std::cos(au) * m_b0 - m_b1) / std::sin(au);
    const double cu = std::clamp(std::copysign(1.0 / std::sqrt(fu * fu + m_b0 * m_b0), fu), -1.0, 1.0);
    const double xu = std::clamp(-(cu * m_z0) / std::sqrt(std::max(1.0 - cu * cu, 1e-30)), m_x0, m_x1);
    const double d_squared = xu * xu + m_z0 * m_z0;
    const double h0 = m_y0 / std::sqrt(d_squared + m_y0 * m_y0);
    const double h1 = m_y1 / std::sqrt(d_squared + m_y1 * m_y1);
    const double h = h0 + place.y * (h1 - h0);
    const double yv = std::clamp(h * std::sqrt(d_squared / std::max(1.0 - h * h, 1e-30)), m_y0, m_y1);
    return xu * m_x + yv * m_y + m_z0 * m_z;
}

SphericalTriangle::SphericalTriangle(const std::array<Vec3, 3>& corners)
    : m_a(glm::normalize(corners[0])), m_b(glm::normalize(corners[1])), m_c(glm::normalize(corners[2]))
{
    const Vec3 ab = glm::cross(m_a, m_b);
    const Vec3 ca = glm::cross(m_c, m_a);
    // Van Oosterom and Strackee 1983, "The solid angle of a plane triangle", doi:10.1109/TBME.1983.325207.
    const double volume = std::abs(glm::dot(ab, m_c));
    const double angle = 2.0 * std::atan2(volume, 1.0 + glm::dot(m_a, m_b) + glm::dot(m_b, m_c) + glm::dot(m_c, m_a));
    const double lengths = glm::length(ab) * glm::length(ca);
    if (!(lengths > 0.0 && volume > 0.0))
        return;
    m_cos_alpha = std::clamp(-glm::dot(ab, ca) / lengths, -1.0, 1.0);
    m_sin_alpha = std::sqrt(1.0 - m_cos_alpha * m_cos_alpha);
    m_solid_angle = m_sin_alpha > 0.0 ? angle : 0.0;
}

Vec3 SphericalTriangle::direction(const Vec2& place) const
{
    const auto beside = [](const Vec3& v, const Vec3& axis) { return glm::normalize(v - axis * glm::dot(v, axis)); };
    // The part of the triangle between a, b and a point on the side a c has the area place.x; s and t as in the paper.
    const double area = place.x * m_solid_angle;
    const double s = std::sin(area) * m_cos_alpha - std::cos(area) * m_sin_alpha;
    const double t = std::cos(area) * m_cos_alpha + std::sin(area) * m_sin_alpha;
    const double u = t - m_cos_alpha;
    const double v = s + m_sin_alpha * glm::dot(m_a, m_b);
    const double below = (v * s + u * t) * m_sin_alpha;
    const double cosine = below != 0.0 ? std::clamp(((v * t - u * s) * m_cos_alpha - v) / below, -1.0, 1.0) : 1.0;
    const Vec3 on_side = m_a * cosine + beside(m_c, m_a) * std::sqrt(1.0 - cosine * cosine);
    const double z = 1.0 - place.y * (1.0 - glm::dot(on_side, m_b));
    return glm::normalize(m_b * z + beside(on_side, m_b) * std::sqrt(std::max(1.0 - z * z, 0.0)));
}

}  // namespace beamspread
