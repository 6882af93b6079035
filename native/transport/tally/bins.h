// Bins of scattering order and of radius. Both are linear parts of octaves, so that a bin is read off the bits of a
// number.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace beamspread {

// Orders 0 .. 15 exactly, then four bins per octave up to 2^20: enough for albedos of 0.99999. Weights of a bin are those
// of its mean order and variance: where power falls as order^-1.5 no total is off by more than 9e-7, with two bins by
// 1.3e-5, with eight by 5e-8; with 8 exact orders by 1.6e-6, with 32 by 4e-7.
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

// Light of fewer scatterings may leave in sharp peaks; then it is blurred: 17 harmonics leave 1 % of g .9 at 7 to 8, as below.
inline constexpr std::uint32_t sharp_orders = 8;

// Places that radii and azimuths are counted around, see transport/tally/poles.h.
inline constexpr std::size_t pole_count = 3;

// Sums are kept in rows: one for each order bin around the first pole, then one for each of the sharp orders around each
// of the others.
inline constexpr std::size_t first_row(std::size_t pole)
{
    return pole == 0 ? 0 : order_bin_count + (pole - 1) * sharp_orders;
}

inline constexpr std::size_t end_row(std::size_t pole)
{
    return order_bin_count + pole * sharp_orders;
}

inline constexpr std::size_t row_count = end_row(pole_count - 1);

inline constexpr std::size_t order_bin_of(std::size_t row)
{
    return row < order_bin_count ? row : (row - order_bin_count) % sharp_orders;
}

// Azimuthal harmonics cos(m phi), m from 0, that are counted at most. Light that was scattered once leaves in a peak
// ahead of the beam that is about cos(theta) wide; every scattering blurs it. Root mean square of what is missing
// around a ring, of a bin's power, for beams at 84 to 85 degrees with ior 1 and these numbers of harmonics:
//   g .8: 17: 77, 37, 15, 5 % for orders 1, 2, 3, 4; 33: 15, 5, 2, 0 %; 65: below 1 %
//   g .9: 17: 122, 81, 49, 27, 11, 1 % for orders 1, 2, 3, 4, 5 to 6, 7 to 8; 33: 34, 18, 8, 2, 1, 0 %; 65: 1, 2, 0 %
inline constexpr std::size_t harmonic_count = 64;

inline constexpr std::size_t harmonics_of(std::size_t row)
{
    const std::size_t order = order_bin_of(row);
    if (order < sharp_orders)
        return harmonic_count;
    return order < exact_orders ? 32 : 16;
}

// Radii in mean free paths: bin 0 is [0, 2^-10), then four bins per octave up to 2^12. What leaves farther out is
// counted in the last bin. With two per octave the worst of 64 x 64 texels differs by 8e-4 to 4e-3 of the brightest, all
// by 2e-3 to 6e-3 of their sum.
inline constexpr int min_radius_exponent = -10;
inline constexpr int max_radius_exponent = 12;
inline constexpr std::size_t radius_bin_count = 1 + 4 * (max_radius_exponent - min_radius_exponent);

// Bits of a float that tell radii of the same bin apart.
inline constexpr int within_bin_bits = 21;

inline std::size_t radius_bin(float radius)
{
    constexpr int bias = 127;
    const auto quarter = static_cast<int>(std::bit_cast<std::uint32_t>(radius) >> within_bin_bits);
    const int bin = quarter - 4 * (bias + min_radius_exponent) + 1;
    return static_cast<std::size_t>(std::clamp(bin, 0, static_cast<int>(radius_bin_count) - 1));
}

// Outer radius of a bin, mean free paths.
inline double radius_bin_edge(std::size_t bin)
{
    return std::ldexp(1.0 + static_cast<double>(bin % 4) / 4.0, min_radius_exponent + static_cast<int>(bin / 4));
}

// Place of the first ring of a row among sums [row][radius bin][harmonic], and their number at the end.
inline constexpr auto ring_offsets = [] {
    std::array<std::size_t, row_count + 1> offsets{};
    for (std::size_t row = 0; row < row_count; ++row)
        offsets[row + 1] = offsets[row] + radius_bin_count * harmonics_of(row);
    return offsets;
}();

}  // namespace beamspread
