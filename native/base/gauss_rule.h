// Gauss-Legendre rule of four points on [-1, 1].
#pragma once

#include <array>

namespace beamspread {

inline constexpr std::array<double, 4> gauss_node = {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626,
                                                     0.86113631159405258};
inline constexpr std::array<double, 4> gauss_weight = {0.34785484513745386, 0.65214515486254614, 0.65214515486254614,
                                                       0.34785484513745386};

}  // namespace beamspread
