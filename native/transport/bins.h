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

// Light of fewer scatterings may leave in sharp peaks; then it is blurred.
inline constexpr std::uint32_t sharp_orders = 8;

// Azimuthal harmonics cos(m phi), m from 0, that are counted at most. Light that was scattered once leaves in a peak
// ahead of the beam that is about cos(theta) wide; every scattering blurs it. Root mean square of what is missing
// around a ring, of a bin's power, for beams at 84 to 85 degrees with ior 1 and these numbers of harmonics:
//   g .8: 17: 77, 37, 15, 5 % for orders 1, 2, 3, 4; 33: 15, 5, 2, 0 %; 65: below 1 %
//   g .9: 17: 122, 81, 49, 27, 11, 1 % for orders 1, 2, 3, 4, 5 to 6, 7 to 8; 33: 34, 18, 8, 2, 1, 0 %; 65: 1, 2, 0 %
inline constexpr std::size_t harmonic_count = 64;

inline constexpr std::size_t harmonics_of(std::size_t order_bin)
{
    if (order_bin < sharp_orders)
        return harmonic_count;
    return order_bin < exact_orders ? 32 : 16;
}

// Radii in mean free paths: bin 0 is [0, 2^-10), then four bins per octave up to 2^12. What leaves farther out is
// counted in the last bin. Around the beam's mirror images in the sides of a thin slab light peaks so sharply, as 1 / r
// around each, that with four bins texels whose border is next to one had up to 10 % of all light wrong (g .9, ior 1.5,
// thickness 1, 85 degrees). Hence finer bins within the radii where that matters.
inline constexpr int min_radius_exponent = -10;
inline constexpr int max_radius_exponent = 12;
inline constexpr int min_fine_exponent = -1;
inline constexpr int max_fine_exponent = 2;
inline constexpr int fine_bits = 5;  // 2^fine_bits bins per octave
inline constexpr double fine_end = 1 << max_fine_exponent;  // mean free paths

// First of the finer bins, their number, and of how many quarters of octaves they take the place.
inline constexpr int first_fine_bin = 4 * (min_fine_exponent - min_radius_exponent) + 1;
inline constexpr int fine_bin_count = (max_fine_exponent - min_fine_exponent) << fine_bits;
inline constexpr int replaced_bin_count = 4 * (max_fine_exponent - min_fine_exponent);

inline constexpr std::size_t radius_bin_count =
    1 + 4 * (max_radius_exponent - min_radius_exponent) + fine_bin_count - replaced_bin_count;

// What is counted apart: all bins, or quarters of octaves, the finer ones in the last of each. Finer bins hold more
// noise and make longer files, which costs where they show nothing.
enum class RadialDetail { quarters, all };

// Bits of a float that tell radii of the same quarter apart. All set, they make the largest of them.
inline constexpr int quarter_bits = 21;
inline constexpr std::uint32_t within_quarter = (1u << quarter_bits) - 1;

inline std::size_t radius_bin(float radius, RadialDetail detail = RadialDetail::all)
{
    constexpr int mantissa_bits = 23;
    constexpr int bias = 127;
    const std::uint32_t set = detail == RadialDetail::quarters ? within_quarter : 0;
    const auto steps = [bits = std::bit_cast<std::uint32_t>(radius) | set](int from_exponent, int bits_per_octave) {
        return static_cast<int>(bits >> (mantissa_bits - bits_per_octave)) -
               ((bias + from_exponent) << bits_per_octave);
    };
    const int quarter = steps(min_radius_exponent, 2) + 1;
    const int bin = quarter - std::clamp(quarter - first_fine_bin, 0, replaced_bin_count) +
                    std::clamp(steps(min_fine_exponent, fine_bits), 0, fine_bin_count);
    return static_cast<std::size_t>(std::clamp(bin, 0, static_cast<int>(radius_bin_count) - 1));
}

// Outer radius of a bin, mean free paths.
inline double radius_bin_edge(std::size_t bin)
{
    const auto edge = [](int exponent, int step, int steps) {
        return std::ldexp(1.0 + static_cast<double>(step % steps) / steps, exponent + step / steps);
    };
    const int i = static_cast<int>(bin);
    if (i < first_fine_bin)
        return edge(min_radius_exponent, i, 4);
    if (i < first_fine_bin + fine_bin_count)
        return edge(min_fine_exponent, i - first_fine_bin + 1, 1 << fine_bits);
    return edge(min_radius_exponent, i - fine_bin_count + replaced_bin_count, 4);
}

// Whether a bin, or the last of the finer ones, ends where a quarter of an octave does.
inline bool ends_quarter(std::size_t bin)
{
    const int fine = static_cast<int>(bin) - first_fine_bin;
    return fine < 0 || fine >= fine_bin_count || (fine + 1) % (1 << (fine_bits - 2)) == 0;
}

// Place of the first ring of an order bin among sums [order bin][radius bin][harmonic], and their number at the end.
inline constexpr auto ring_offsets = [] {
    std::array<std::size_t, order_bin_count + 1> offsets{};
    for (std::size_t b = 0; b < order_bin_count; ++b)
        offsets[b + 1] = offsets[b] + radius_bin_count * harmonics_of(b);
    return offsets;
}();

}  // namespace beamspread
