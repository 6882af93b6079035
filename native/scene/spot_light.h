// A point light behind a cone: E = P cos(theta) f / (4 pi r^2), the power P that of the whole sphere, whatever the cone.
#pragma once

#include "scene/point_light.h"

namespace beamspread {

// How the falloff f follows from the angle gamma between the lamp's -z axis and the ray; with c = cos(gamma),
// c0 = cos(spot_size / 2), f = smoothstep((c - c0) / ((1 - c0) blend)), a step at c0 where blend is 0.
enum class SpotFalloff {
    // Measured in Blender 4.2, 4.5, 5.0; the change was made for 3.5 (D17129): c is taken in the lamp's own space, so a
    // scaled lamp has an elliptic cone. (Cycles culls the far side of the cone of a lamp that is sheared by its
    // parents; we do not.)
    scaled,
    // Blender 3.4: the lamp's scale is ignored, and f has a further factor c.
    legacy,
};

class SpotLight final : public Light {
public:
    // The columns of `lamp_to_world` are the lamp's axes in the world with their scale, it shines along -z.
    // `spot_size` is the full angle of the cone in (0, pi], `blend` in [0, 1]. Throws InvalidArgument.
    SpotLight(const Vec3& position, const Mat3& lamp_to_world, double spot_size, double blend, SpotFalloff falloff);
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = m_point.source().position}; }

private:
    double falloff(const Vec3& travel) const;

    PointLight m_point;
    Mat3 m_world_to_lamp;
    double m_cos_half_size;
    double m_smooth;  // the span of cosines over which the border fades
    SpotFalloff m_falloff;
};

}  // namespace beamspread
