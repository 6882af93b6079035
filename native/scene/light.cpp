#include "scene/light.h"

#include <algorithm>
#include <limits>

#include "base/constants.h"
#include "scene/checks.h"

namespace beamspread {

SunLight::SunLight(const Vec3& direction) : m_travel(detail::unit_vector("direction", direction)) {}

void SunLight::arrive(std::span<const Vec3> points, Arrival* arrivals) const
{
    std::fill_n(arrivals, points.size(),
                Arrival{.travel = m_travel, .flux = 1.0, .distance = std::numeric_limits<double>::infinity()});
}

PointLight::PointLight(const Vec3& position) : m_position(position)
{
    detail::check_finite("position", position);
}

void PointLight::arrive(std::span<const Vec3> points, Arrival* arrivals) const
{
    for (const Vec3& point : points) {
        const Vec3 way = point - m_position;
        const double distance = glm::length(way);
        const double inverse = 1.0 / distance;
        *arrivals++ = {.travel = way * inverse, .flux = 0.25 * inv_pi * inverse * inverse, .distance = distance};
    }
}

void SpotLight::arrive(std::span<const Vec3> points, Arrival* arrivals) const
{
    m_point.arrive(points, arrivals);
    for (Arrival& arrival : std::span(arrivals, points.size()))
        arrival.flux *= m_cone.falloff(arrival.travel);
}

}  // namespace beamspread
