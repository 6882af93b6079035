// Inner loops of directions and of light, see base/platform.h.
#pragma once

#include <cstddef>

namespace beamspread {

// Azimuths beta and tan(theta / 2) of directions of travel of any length, (x, y, z) after (x, y, z). Where the irradiance
// is zero the direction may be anything.
void find_angles(const float* directions, const float* irradiance, float* cos_beta, float* sin_beta,
                 float* half_tangent, std::size_t count);

// By how much the squared length of a direction may differ from 1: unit vectors are off by 1e-7 in single precision and by
// up to 1e-3 in half precision; what is off by more was never normalized.
inline constexpr float unit_tolerance = 2e-3f;

// Whether these are beams: irradiance finite and >= 0, and where it is not zero a unit vector with z < 0.
bool are_beams(const float* irradiance, const float* directions, std::size_t count);

}  // namespace beamspread
