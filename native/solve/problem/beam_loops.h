// Inner loops of directions and of light, see base/platform.h.
#pragma once

#include <cstddef>

namespace beamspread {

// Azimuths beta and tan(theta / 2) of directions of travel of any length, (x, y, z) after (x, y, z). Where the irradiance
// is zero the direction may be anything.
void find_angles(const float* directions, const float* irradiance, float* cos_beta, float* sin_beta,
                 float* half_tangent, std::size_t count);

}  // namespace beamspread
