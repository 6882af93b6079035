#include "scene/cone.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

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
    const double phi = 2.0 * pi * place.y;
    return m_frame.to_world({across * std::cos(phi), across * std::sin(phi), along});
}

Vec3 Cone::tangent(const Vec2& place, double radius_squared) const
{
    const double across = std::sqrt(place.x * radius_squared);
    const double phi = 2.0 * pi * place.y;
    return glm::normalize(m_frame.to_world({across * std::cos(phi), across * std::sin(phi), 1.0}));
}

// Snyder 1996, "Area light sources for real-time graphics", MSR-TR-96-11, for what the horizon cuts off.
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
    const double radius = std::sqrt(place.x);
    const double phi = 2.0 * pi * place.y;
    return {radius * std::cos(phi), radius * std::sin(phi), std::sqrt(1.0 - place.x)};
}

}  // namespace beamspread
