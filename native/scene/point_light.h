// Light from one point into all directions: E = P cos(theta) / (4 pi r^2), P the power in W, whatever the lamp's scale.
#pragma once

#include "scene/light.h"

namespace beamspread {

class PointLight final : public Light {
public:
    // Throws InvalidArgument.
    explicit PointLight(const Vec3& position);
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = m_position, .is_smooth = true}; }

private:
    Vec3 m_position;
};

}  // namespace beamspread
