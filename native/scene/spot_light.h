// A point light behind a cone: E = P cos(theta) f / (4 pi r^2), the power P that of the whole sphere, whatever the cone.
#pragma once

#include "scene/point_light.h"
#include "scene/spot_cone.h"

namespace beamspread {

class SpotLight final : public Light {
public:
    // Throws InvalidArgument.
    SpotLight(const Vec3& position, const SpotCone& cone);
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = m_point.source().position}; }

private:
    PointLight m_point;
    SpotCone m_cone;
};

}  // namespace beamspread
