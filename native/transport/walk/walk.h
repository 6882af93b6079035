// Random walks of photons through a medium.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "base/random.h"
#include "medium/medium.h"
#include "transport/tally/bins.h"
#include "transport/tally/tally.h"

namespace beamspread {

using SideTallies = std::array<Tally, side_count>;
using SideWeights = std::array<OrderWeights, side_count>;

// Walks one photon that has entered at O, travelling at theta_inside (radians) from the inward normal
// toward +u, and adds what leaves after at least one scattering to the tallies: see transport/walk/walk.h. Unscattered
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

struct WalkPlan {
    explicit WalkPlan(const Medium& medium) : exit_cone(1.0 / (medium.ior * medium.ior))
    {
        // Scatterings that change the direction as much as one isotropic one.
        const double transport = 1.0 / (1.0 - std::max(0.0, medium.g));
        last_expected_order = 1 + static_cast<std::uint32_t>(0.2 * transport);
        first_roulette = static_cast<std::uint32_t>(8.0 * medium.ior * medium.ior * transport);
    }

    // Squared sine of the half angle of the cone that can leave.
    double exit_cone;

    // Up to this order exits are tallied at their expected value at every flight, and sampled by connections too: a
    // forward-peaked phase function seldom sends such light back to the surface. Beyond it the exits that happen are
    // tallied, because the sum of the expected ones along a walk varies more than the one that ends it.
    std::uint32_t last_expected_order;

    // A walk that outlives 2^k first_roulette scatterings goes on with a certain probability at each k. Internal
    // reflection keeps light inside for longer.
    std::uint32_t first_roulette;
};

// Every photon goes on from its last expected exit as this many walks with an equal part of its weight: after so few
// scatterings next to nothing is decided yet of where it will leave, and those are not walked again for
// each. Measured over three media, 2 and 8 take .55 and 1.8 times as long for 1.2 and .87 times the noise of a map.
inline constexpr std::size_t late_walks = 4;

// In a half-space the chance to be still inside falls like order^-1/2. Giving up as many again makes each octave
// of orders cost the same and add the same variance.
inline constexpr double roulette_survival = 0.70710678118654752;

// Orders beyond this matter to albedos above .9999 only, and would take most of the time if every octave took
// the same. Half and twice the order change time and noise by no more than 10 %, the measurement's own error; so do survivals
// of .35 and .7.
inline constexpr std::uint32_t last_common_order = 1u << 13;
inline constexpr double late_roulette_survival = 0.5;

// Exits less likely than this are tallied at random with this weight: unbiased, and the many deep
// flights that have next to no chance to leave cost one comparison. Half and twice as much change the noise by 1 % and the time
// by less than its measurement can tell, 10 %.
inline constexpr double rare_exit = 0.02;
inline constexpr double rare_exit_distance = 3.912023005428146;  // exp of its negative is rare_exit

}  // namespace beamspread
