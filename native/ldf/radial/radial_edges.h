// Radii between which a profile is a cubic: the edges of the radius bins (transport/tally/bins.h), and finer edges for
// profiles that include peaks of other poles.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "transport/tally/bins.h"

namespace beamspread {

// Range of the fine edges, as powers of two in mean free paths, and their density, 2^fine_bits per octave. A wider
// range or more edges: smaller errors around mirror images in slabs, more time.
inline constexpr int min_fine_exponent = -5;
inline constexpr int max_fine_exponent = 2;
inline constexpr int fine_bits = 4;
inline constexpr double fine_end = 1 << max_fine_exponent;

// Index of the first fine edge, number of fine edges, and number of bin edges that they replace.
inline constexpr std::size_t first_fine_edge = 4 * std::size_t{min_fine_exponent - min_radius_exponent} + 1;
inline constexpr std::size_t fine_edge_count = std::size_t{max_fine_exponent - min_fine_exponent} << fine_bits;
inline constexpr std::size_t replaced_edge_count = 4 * std::size_t{max_fine_exponent - min_fine_exponent};
inline constexpr std::size_t edge_count = radius_bin_count + fine_edge_count - replaced_edge_count;

// The edges of the bins, enough for light around one pole; or all edges.
enum class RadialDetail { bins, all };

// Radius of an edge, mean free paths, ascending.
double radial_edge(std::size_t edge);

// Index of the first edge beyond a radius, at most the last.
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

// Range of radii (mean free paths) in which bins are divided for comparing profiles, and the number of parts. A wider
// range or more parts: smaller errors, more time.
inline constexpr double divided_begin = 0.5;
inline constexpr double divided_end = 4.0;
inline constexpr int bin_steps = 8;

// Radii (mean free paths, ascending) at which profiles are compared and their integrals divided: the edges of this
// detail, and `bin_steps` points per bin between `divided_begin` and `divided_end`.
std::vector<double> profile_radii(RadialDetail detail);

// True if an edge is the edge of a bin.
bool is_bin_edge(std::size_t edge);

}  // namespace beamspread
