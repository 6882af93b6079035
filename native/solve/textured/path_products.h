// The inner loop of shared paths, compiled for several instruction sets; all give the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace beamspread {

// Rows and columns of the tiles of texels that are summed at once. Larger: less time for each texel, and light of a spot
// shares its paths with more texels around it.
inline constexpr std::size_t tile_rows = 4;
inline constexpr std::size_t tile_columns = 16;
inline constexpr std::size_t tile_texels = tile_rows * tile_columns;

// Paths whose places are offsets of values in the planes of a sublattice: `places` of path p begin at first[p] and are the
// entry, then the scatterings. The light has planes of its own.
struct PlacedPaths {
    std::span<const std::ptrdiff_t> light;  // [path], the entry in its planes
    std::span<const std::ptrdiff_t> places;
    std::span<const std::size_t> first;
    std::span<const float> weight;  // [path] of the plain sum
};

// Planes at the first texel of a tile.
struct TilePlanes {
    const float* light;
    const float* coverage;  // nullptr: 1
    const float* entering;
    const float* albedo;
    std::ptrdiff_t stride;  // from a row to the next
};

// For the texels i of a tile, over the first `count` paths; sums are stored row by row:
//   textured[i] += scale * light[entry + i] * coverage[entry + i] * product of the albedos at the scatterings
//   plain[i] += scale * weight * light[entry + i] * coverage[entry + i] * entering[entry + i]
void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const TilePlanes& planes,
                       float* textured, float* plain);

}  // namespace beamspread
