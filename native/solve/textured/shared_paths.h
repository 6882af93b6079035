// Random walks that all texels of a plane share: where a path goes depends neither on where it starts nor on the albedo.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "medium/medium.h"

namespace beamspread {

// Offset of a texel from the texel that light leaves.
struct PathPlace {
    std::int32_t x;
    std::int32_t y;
};

// Paths that leave through the face that counts, as places: the entry, then each scattering.
struct SharedPaths {
    std::vector<PathPlace> places;
    std::vector<std::size_t> first{0};  // [path], and the number of all places
    std::vector<std::size_t> walk;  // [path], ascending; other walks end inside

    std::size_t size() const { return walk.size(); }
};

// How paths are drawn: light travels along `travel`, in the frame of the plane, z < 0. At each scattering a path goes on
// with the probability `survival`, whatever the albedo there.
struct PathPlan {
    Medium medium;
    Vec3 travel{0.0, 0.0, -1.0};
    double survival = 0.9;
    std::array<double, 2> texels_per_path{1.0, 1.0};  // a mean free path in texels, along x and y
    bool is_through = false;  // paths leave through the far face of a slab
};

// Adds the paths of this many walks. Each leaves at a random point of its texel.
void add_paths(SharedPaths& paths, const PathPlan& plan, std::size_t walks, Random& random);

}  // namespace beamspread
