#include "scene/spot_light.h"

namespace beamspread {

SpotLight::SpotLight(const Vec3& position, const SpotCone& cone) : m_point(position), m_cone(cone) {}

void SpotLight::arrive(std::span<const Vec3> points, Arrival* arrivals) const
{
    m_point.arrive(points, arrivals);
    for (Arrival& arrival : std::span(arrivals, points.size()))
        arrival.flux *= m_cone.falloff(arrival.travel);
}

}  // namespace beamspread
