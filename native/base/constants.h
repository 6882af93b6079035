// Mathematical constants and a quadrature rule, in double precision.
#pragma once

#include <array>
#include <numbers>

namespace beamspread {

inline constexpr double pi = std::numbers::pi;
inline constexpr double inv_pi = std::numbers::inv_pi;
inline constexpr double radians_per_degree = pi / 180.0;

// Nodes and weights of the Gauss-Legendre rule of four points on [-1, 1].
inline constexpr std::array<double, 4> gauss_node = {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626,
                                                     0.86113631159405258};
inline constexpr std::array<double, 4> gauss_weight = {0.34785484513745386, 0.65214515486254614, 0.65214515486254614,
                                                       0.34785484513745386};

}  // namespace beamspread
