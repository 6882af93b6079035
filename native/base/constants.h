// Mathematical constants in double precision.
#pragma once

#include <numbers>

namespace beamspread {

inline constexpr double pi = std::numbers::pi;
inline constexpr double inv_pi = std::numbers::inv_pi;
inline constexpr double radians_per_degree = pi / 180.0;

}  // namespace beamspread
