// The inner loop of shared paths, compiled for several instruction sets; all give the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace beamspread {

// Texels that are summed at once.
inline constexpr std::size_t texels_per_run = 32;

// Paths whose places are offsets of values in the planes of a sublattice: `places` of path p begin at first[p] and are the
// entry, then the scatterings.
struct PlacedPaths {
    std::span<const std::ptrdiff_t> places;
    std::span<const std::size_t> first;
    std::span<const float> weight;  // [path] of the plain sum
};

// For a run of texels from `at` on, over the first `count` paths:
//   textured[i] += scale * light[entry + i] * product of the albedos at the scatterings
//   plain[i] += scale * weight * light[entry + i] * entering[entry + i]
void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const float* light,
                       const float* entering, const float* albedo, float* textured, float* plain);

}  // namespace beamspread
