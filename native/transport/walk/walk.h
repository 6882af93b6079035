// Random walks of photons through a medium.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "base/random.h"
#include "medium/medium.h"
#include "transport/tally/tally.h"

namespace beamspread {

using SideTallies = std::array<Tally, side_count>;
using SideWeights = std::array<OrderWeights, side_count>;

// Walks one photon that has entered at O, travelling at theta_inside (radians) from the inward normal
// toward +u, and adds what leaves after at least one scattering to the tallies: see transport/walk/walk_plan.h. Unscattered
// light is left out: it has a closed form (transport/exact/ballistic.h).
void walk_photon(const Medium& medium, double theta_inside, Random& random, SideTallies& tallies);

// Consecutive batches of photons for one angle.
struct WalkJob {
    const Medium& medium;
    double theta_inside;
    std::uint64_t seed;
    std::uint64_t stream;  // of random numbers; with the seed and the batch it determines the result
    std::size_t first_batch;
    std::span<const std::uint64_t> photons;  // of each batch
    std::size_t batches_per_tally;
    std::span<SideTallies> tallies;  // of as many batches each
    std::span<SideWeights> weights;  // of each batch
    Progress& progress;
};

// One implementation of the walk: `scalar` is walk_photon in a loop, the truth for the others, which walk as many
// photons at a time as a vector has lanes, in single precision.
struct WalkKernel {
    std::string_view name;
    void (*walk)(const WalkJob& job);
};

// Those that this processor can run, fastest first.
std::vector<WalkKernel> walk_kernels();

// Photons between two reports of progress.
inline constexpr std::uint64_t photons_per_progress = 512;

}  // namespace beamspread
