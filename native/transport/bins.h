// Bins of scattering order and of radius. Both are linear quarters of octaves, so that a bin is
// read off the bits of a number.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace beamspread {

// Number of azimuthal harmonics kept, cos(m phi) for m = 0 .. 16. Half as many leave 5 % of the power of a beam at 85
// degrees in the wrong places (g .8, ior 1), these .8 %.
inline constexpr std::size_t harmonic_count = 17;

// Orders 0 .. 15 exactly, then four bins per octave up to 2^20: enough for albedos of 0.99999.
inline constexpr std::uint32_t exact_orders = 16;
inline constexpr std::uint32_t max_order = 1u << 20;
inline constexpr std::size_t order_bin_count = exact_orders + 4 * 16;

inline std::size_t order_bin(std::uint32_t order)
{
    if (order < exact_orders)
        return order;
    const int octave = std::bit_width(order) - 1;
    const std::uint32_t quarter = (order >> (octave - 2)) & 3u;
    return exact_orders + 4 * static_cast<std::size_t>(octave - 4) + quarter;
}

// Radii in mean free paths: bin 0 is [0, 2^-10), then four bins per octave up to 2^12. What leaves
// farther out is counted in the last bin.
inline constexpr int min_radius_exponent = -10;
inline constexpr int max_radius_exponent = 12;
inline constexpr std::size_t radius_bin_count = 1 + 4 * (max_radius_exponent - min_radius_exponent);

inline std::size_t radius_bin(float radius)
{
    constexpr int mantissa_bits = 23;
    constexpr int bias = 127;
    const int quarters = static_cast<int>(std::bit_cast<std::uint32_t>(radius) >> (mantissa_bits - 2));
    const int bin = quarters - 4 * (bias + min_radius_exponent) + 1;
    return static_cast<std::size_t>(std::clamp(bin, 0, static_cast<int>(radius_bin_count) - 1));
}

// Outer radius of a bin, mean free paths.
inline double radius_bin_edge(std::size_t bin)
{
    const std::size_t octave = bin / 4;
    const double base =
        static_cast<double>(std::uint64_t{1} << octave) / static_cast<double>(1 << -min_radius_exponent);
    return base * (1.0 + 0.25 * static_cast<double>(bin % 4));
}

}  // namespace beamspread
