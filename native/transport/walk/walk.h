// Random walks of photons through a medium, as MCML (Wang, Jacques, Zheng 1995, doi:10.1016/0169-2607(95)01640-F)
// without absorption: the tallies keep the scattering order, from which every albedo follows.
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

// Consecutive batches of photons that entered at O, travelling toward +u at one angle.
struct WalkJob {
    const Medium& medium;
    double curvature;  // of the boundary, 1 / mean free path, see transport/walk/walk_shape.h; 0 in slabs
    double theta_inside;  // radians from the inward normal
    std::uint64_t seed;
    std::uint64_t stream;  // of random numbers; seed, stream and batch determine the result
    std::size_t first_batch;
    std::span<const std::uint64_t> photons;  // of each batch
    std::size_t batches_per_tally;
    std::span<SideTallies> tallies;  // [batch / batches_per_tally]
    std::span<SideWeights> weights;  // [batch]
    Progress& progress;
};

// Walks all photons of a job one after the other and tallies their exits after at least one scattering. Unscattered
// light has a closed form (transport/exact/exact_totals.h).
void walk_scalar(const WalkJob& job);

// One implementation of the walk. `scalar` is the reference for the others, which walk one photon per vector lane, in
// single precision.
struct WalkKernel {
    std::string_view name;
    void (*walk)(const WalkJob& job);
};

// Kernels that this processor can run, fastest first.
std::vector<WalkKernel> walk_kernels();

// Photons between two progress reports. More: less overhead, slower cancellation.
inline constexpr std::uint64_t photons_per_progress = 512;

// Scattering order beyond which roulette uses the late survival, because later orders matter only to albedos above
// .9999. Larger values of either: less noise at such albedos, more time.
inline constexpr std::uint32_t latest_common_order = 1u << 13;
inline constexpr double late_roulette_survival = 0.5;

struct WalkPlan {
    WalkPlan(const Medium& medium, double curvature) : exit_cone(1.0 / (medium.ior * medium.ior))
    {
        // Compute the transport mean free path in scatterings, 1 / (1 - g).
        const double transport = 1.0 / (1.0 - std::max(0.0, medium.g));
        last_expected_order = 1 + static_cast<std::uint32_t>(0.2 * transport);
        first_roulette = static_cast<std::uint32_t>(8.0 * medium.ior * medium.ior * transport);
        // Diffusion takes about three times (radius / transport mean free path)^2 transport mean free paths to feel a
        // hollow's curvature. Much of the light that is still inside then never returns.
        if (const double radius = -1.0 / (transport * curvature); curvature < 0.0)
            last_common_order = static_cast<std::uint32_t>(
                std::clamp(3.0 * radius * radius * transport, 2.0 * first_roulette, 1.0 * latest_common_order));
    }

    // Squared sine of the critical angle: the half angle of the cone that can leave.
    double exit_cone;

    // Up to this scattering order every flight tallies its expected exit and its connections: a forward-peaked phase
    // function seldom sends such light back to the surface. Later flights tally actual exits, which vary less than the
    // sum of expected exits along a long walk.
    std::uint32_t last_expected_order;

    // Russian roulette (Arvo, Kirk 1990, doi:10.1145/97879.97886) is played at the scattering orders 2^k
    // first_roulette. Internal reflection keeps light inside for longer and delays it.
    std::uint32_t first_roulette;

    // Scattering order beyond which the late survival applies.
    std::uint32_t last_common_order = latest_common_order;
};

// Walks that continue each photon after its last expected exit, with equal parts of its weight. More: less noise, more
// time.
inline constexpr std::size_t late_walks = 4;

// Probability to survive one roulette up to `WalkPlan::last_common_order`. In a half-space the number of photons falls
// like order^-1/2; this survival makes each octave of orders cost the same and add the same variance.
inline constexpr double roulette_survival = 0.70710678118654752;

// Probability below which an exit is tallied at random with this weight: deep flights, which hardly ever leave, cost
// one comparison. Larger: less time, more noise.
inline constexpr double rare_exit = 0.02;
inline constexpr double rare_exit_distance = 3.912023005428146;  // mean free paths: -log(rare_exit)

}  // namespace beamspread
