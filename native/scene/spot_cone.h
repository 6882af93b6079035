// How a spot lamp's light falls off with the angle to its axis.
#pragma once

#include "base/vec.h"

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

class SpotCone {
public:
    // The columns of `lamp_to_world` are the lamp's axes in the world with their scale, it shines along -z.
    // `spot_size` is the full angle of the cone in (0, pi], `blend` in [0, 1]. Throws InvalidArgument.
    SpotCone(const Mat3& lamp_to_world, double spot_size, double blend, SpotFalloff falloff);

    // f of light that travels along this unit vector; 0 if it is no number.
    double falloff(const Vec3& travel) const;

private:
    Mat3 m_world_to_lamp;
    double m_cos_half_size;
    double m_smooth;  // the span of cosines over which the border fades
    SpotFalloff m_falloff;
};

}  // namespace beamspread
