// Radii between which a profile is a cubic: the edges of the radius bins (transport/tally/bins.h), and finer ones where a
// profile may have taken in peaks around another place.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "transport/tally/bins.h"

namespace beamspread {

// 2^fine_bits edges per octave between these powers of two, mean free paths. Lamps .1 to 1.8 mean free paths above slabs of
// .3 to 4 with an ior above 1, against 2^7 from -7 on: the worst texel is off by 5e-3 of the brightest; with 2^5 from -1 on
// by 2.3e-2. With 2^5 from -5 on slabs' images differ as much, 2e-3 to 9e-3, in 1.08 times the time. Up to 2^4 mean free
// paths changes nothing.
inline constexpr int min_fine_exponent = -5;
inline constexpr int max_fine_exponent = 2;
inline constexpr int fine_bits = 4;
inline constexpr double fine_end = 1 << max_fine_exponent;

// The first of the finer edges, their number, and of how many edges of bins they take the place.
inline constexpr std::size_t first_fine_edge = 4 * std::size_t{min_fine_exponent - min_radius_exponent} + 1;
inline constexpr std::size_t fine_edge_count = std::size_t{max_fine_exponent - min_fine_exponent} << fine_bits;
inline constexpr std::size_t replaced_edge_count = 4 * std::size_t{max_fine_exponent - min_fine_exponent};
inline constexpr std::size_t edge_count = radius_bin_count + fine_edge_count - replaced_edge_count;

// Edges of the bins alone, which do for light that is seen around one place, or all.
enum class RadialDetail { bins, all };

// Radius of an edge, mean free paths, ascending.
double radial_edge(std::size_t edge);

// The first edge beyond a radius, or the last of all.
inline std::size_t edge_beyond(float radius)
{
    constexpr int bias = 127;
    constexpr int within_finest_bits = 23 - fine_bits;
    const std::size_t bin = radius_bin(radius);
    if (bin < first_fine_edge)
        return bin;
    if (bin >= first_fine_edge + replaced_edge_count)
        return bin + fine_edge_count - replaced_edge_count;
    const std::uint32_t step = std::bit_cast<std::uint32_t>(radius) >> within_finest_bits;
    return first_fine_edge + step - (static_cast<std::uint32_t>(bias + min_fine_exponent) << fine_bits);
}

// Where profiles of this detail are compared, and their integrals divided, mean free paths, ascending: all their edges, and
// of bins between the two ends this many steps, without which the worst texel of bench/terms.py uses .90 of what a tolerance
// of .001 allows, with them .57.
inline constexpr double divided_begin = 0.5;
inline constexpr double divided_end = 4.0;
inline constexpr int bin_steps = 8;
std::vector<double> profile_radii(RadialDetail detail);

// Whether an edge is one of the bins'.
bool is_bin_edge(std::size_t edge);

}  // namespace beamspread
