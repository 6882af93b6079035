// Sums of light from many sources at one target, vectorized.
#pragma once

#include <cstddef>

#include "base/vec.h"
#include "solve/surface/pair_tables.h"

namespace beamspread {

// A sample or a cluster of samples that sends light.
struct PairSource {
    Vec3f position;
    float area;  // m^2
    Vec3f normal;
    std::uint32_t disk;  // index in the tables; `no_disk`: a point
    Vec3f tangent;
    std::uint32_t moments;  // index of its moments
};
inline constexpr std::uint32_t no_disk = ~std::uint32_t{0};

struct PairTarget {
    Vec3f position;
    Vec3f normal;
};

// Adds the radiant exitance at a target that sources cause: sums[result], and in `beyond` the part of result 0 from
// pairs that bend more than the tables. `moments` has the sources' moments, each of `stride` values.
void add_pairs(const PairTables& tables, const PairTarget& target, const PairSource* sources, std::size_t count,
               const float* moments, std::size_t stride, float* sums, float& beyond);

}  // namespace beamspread
