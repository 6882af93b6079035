#include "scene/sun_light.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

SunLight::SunLight(const Vec3& direction) : m_travel(glm::normalize(direction))
{
    if (!detail::is_finite(m_travel))
        reject("direction", detail::to_text(direction), "a finite vector that is not 0");
}

void SunLight::arrive(std::span<const Vec3> points, Arrival* arrivals) const
{
    std::fill_n(arrivals, points.size(),
                Arrival{.travel = m_travel, .flux = 1.0, .distance = std::numeric_limits<double>::infinity()});
}

}  // namespace beamspread
