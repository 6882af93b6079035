// Sums of light from many sources at one target, vectorized.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

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
};

struct ClusterSource : PairSource {
    float spread;  // a quarter of the mean squared distance of the light from the position, m^2
    float bend = 0.0f;  // mean product of normals and positions, less that of their means, m
    std::array<float, 6> squares{};  // means of xx, yy, zz, xy, yz, zx of the light around the position, m^2
};

// Sources that targets share.
struct PairSources {
    std::vector<std::span<const PairSource>> samples;
    std::vector<const ClusterSource*> clusters;
};

// Targets side by side, which share their sources.
struct PairTargets {
    static constexpr std::size_t most = 8;
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

    std::size_t count = 0;
    std::array<std::array<float, most>, 3> position{};  // [axis][target]
    std::array<std::array<float, most>, 3> normal{};
    std::array<std::uint32_t, most> own{};  // index of a target's own moments, which are no source of it; or none

    void add(const Vec3f& at, const Vec3f& up, std::uint32_t moments)
    {
        for (int axis = 0; axis < 3; ++axis) {
            position[static_cast<std::size_t>(axis)][count] = at[axis];
            normal[static_cast<std::size_t>(axis)][count] = up[axis];
        }
        own[count] = moments;
        ++count;
    }
};

// Adds the radiant exitance at targets that sources cause: sums[target][result], and in beyond[target] the part of result
// 0 from pairs that bend more than the tables. `moments` has the sources' moments, each of `stride` values.
void add_pairs(const PairTables& tables, const PairTargets& targets, const PairSources& sources, const float* moments,
               std::size_t stride, float* sums, float* beyond);

}  // namespace beamspread
