// Bins of scattering order and of radius: equal parts of octaves, which can be read off the bits of a number.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace beamspread {

// Number of scattering orders with a bin of their own; then four bins per octave up to `max_order`, which serves
// albedos up to 0.99999. More exact orders: smaller errors of totals, larger files.
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

// Number of scatterings from which light is too blurred to leave in sharp peaks. Higher: sharper images in slabs,
// larger files.
inline constexpr std::uint32_t sharp_orders = 8;

// Number of points that radii and azimuths are measured around, see transport/tally/tally.h.
inline constexpr std::size_t pole_count = 3;

// A tally has rows: one for each order bin around the first pole, then one for each sharp order around each other pole.
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

// Number of azimuthal harmonics cos(m phi), m from 0. Light that scattered once leaves in a peak ahead of the beam,
// about cos(theta) wide; every scattering blurs it. More: sharper peaks at grazing angles, larger files.
inline constexpr std::size_t harmonic_count = 64;

inline constexpr std::size_t harmonics_of(std::size_t row)
{
    const std::size_t order = order_bin_of(row);
    if (order < sharp_orders)
        return harmonic_count;
    return order < exact_orders ? 32 : 16;
}

// Radii in mean free paths: bin 0 is [0, 2^-10), then four bins per octave up to 2^12. The last bin includes all light
// that leaves farther out. A wider range or more bins per octave: sharper images, larger files.
inline constexpr int min_radius_exponent = -10;
inline constexpr int max_radius_exponent = 12;
inline constexpr std::size_t radius_bin_count = 1 + 4 * (max_radius_exponent - min_radius_exponent);

// Number of low bits of a float in which radii of the same bin differ.
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

// Index of each row's first ring in sums [row][radius bin][harmonic]; the last element is the number of sums.
inline constexpr auto ring_offsets = [] {
    std::array<std::size_t, row_count + 1> offsets{};
    for (std::size_t row = 0; row < row_count; ++row)
        offsets[row + 1] = offsets[row] + radius_bin_count * harmonics_of(row);
    return offsets;
}();

}  // namespace beamspread
