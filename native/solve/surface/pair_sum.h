// Sums of light from many sources at one target, vectorized.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/vec.h"
#include "solve/surface/pair_tables.h"

namespace beamspread {

// A sample or a cluster of samples that sends light.
struct PairSource {
    Vec3f position;
    float area;  // m^2; 1 where the moments include it
    Vec3f normal;  // of a cluster the mean of unit vectors
    std::uint32_t disk;  // index in the tables; not of a cluster
    Vec3f tangent;  // x of the frame
    std::uint32_t moments;  // index of its moments
    Vec3f binormal;  // y of the frame
    float spread;  // a quarter of the mean squared distance of a cluster's light from its position, m^2
};

struct PairTarget {
    Vec3f position;
    Vec3f normal;
};

// Adds the radiant exitance at a target that sources cause: sums[result], and in `beyond` the part of result 0 from
// pairs that bend more than the tables. `moments` has the sources' moments, each of `stride` values. The sources are
// samples, or all clusters.
void add_pairs(const PairTables& tables, const PairTarget& target, std::span<const PairSource> sources,
               bool are_clusters, const float* moments, std::size_t stride, float* sums, float& beyond);

}  // namespace beamspread
