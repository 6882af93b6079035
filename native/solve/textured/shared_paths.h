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

// How walks are drawn: light travels down into the medium, in the plane of x and z. At each scattering a walk goes on with
// the probability `survival`, whatever the albedo there.
struct WalkPlan {
    Medium medium;
    double cos_theta = 1.0;  // of the light's angle from the normal
    double survival = 0.9;
    bool is_through = false;  // walks leave through the far face of a slab
};

// Walks that leave through the face of interest. Places of a walk: its entry, then its scatterings.
struct Walks {
    std::vector<Vec2> places;  // seen from the exit, mean free paths
    std::vector<Vec2> within;  // [path], the point of its texel that light leaves, in [0, 1)
    std::vector<std::size_t> first{0};  // [path], and the number of all places
    std::vector<std::size_t> walk;  // [path], ascending; other walks end inside
    std::size_t count = 0;  // of all walks

    std::size_t size() const { return walk.size(); }
};

// Draws `count` walks.
Walks drawn_walks(const WalkPlan& plan, std::size_t count, Random& random);

// Offset of a texel from the texel that light leaves.
struct PathPlace {
    std::int32_t x;
    std::int32_t y;
};

// How light of one azimuth goes the way of walks: they turn with it.
struct Turn {
    // `travel`: of the light, in the frame of the plane; `texels_per_path`: a mean free path in texels, along x and y.
    Turn(const Vec3& travel, const std::array<double, 2>& texels_per_path);

    PathPlace operator()(const Vec2& place, const Vec2& within) const;

    Vec2 right;  // texels along x for a mean free path along x and along y of a walk
    Vec2 up;
};

}  // namespace beamspread
