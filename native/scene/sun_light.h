// Parallel light: E = S cos(theta), S the strength in W/m^2.
#pragma once

#include "scene/light.h"

namespace beamspread {

class SunLight final : public Light {
public:
    // `direction` of travel, any length but 0; throws InvalidArgument.
    explicit SunLight(const Vec3& direction);
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = -m_travel, .is_far = true}; }

private:
    Vec3 m_travel;
};

}  // namespace beamspread
