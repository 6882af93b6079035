#include "scene/point_light.h"

#include "base/constants.h"
#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

PointLight::PointLight(const Vec3& position) : m_position(position)
{
    if (!detail::is_finite(position))
        reject("position", detail::to_text(position), "finite coordinates in metres");
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

}  // namespace beamspread
