// What every implementation of the photon walk agrees on: which exits are tallied how, and when a walk is given up.
#pragma once

#include <algorithm>
#include <cstdint>

#include "medium/medium.h"
#include "transport/bins.h"

namespace beamspread {

struct WalkPlan {
    explicit WalkPlan(const Medium& medium)
        : last_connected_order(static_cast<std::uint32_t>(4.0 / (1.0 - std::max(0.0, medium.g)))),
          first_roulette(static_cast<std::uint32_t>(4.0 * medium.ior * medium.ior / (1.0 - std::max(0.0, medium.g)))),
          exit_cone(1.0 / (medium.ior * medium.ior))
    {
    }

    // Up to this order exits are also sampled by connections: beyond it light has forgotten its direction,
    // and the walk itself finds its way out.
    std::uint32_t last_connected_order;

    // A walk that outlives 2^k first_roulette scatterings goes on with the probability `survival` at each k. In
    // scatterings that change the direction as much as one isotropic one; internal reflection keeps light inside for
    // longer. Measured best of 2 to 32 over albedos .2 to .9999, flat around it.
    std::uint32_t first_roulette;

    // Squared sine of the half angle of the cone that can leave.
    double exit_cone;
};

// In a half-space the chance to be still inside falls like order^-1/2. Giving up as many again makes each octave
// of orders cost the same and add the same variance.
inline constexpr double roulette_survival = 0.70710678118654752;

// Orders beyond this matter to albedos above .9999 only, and would take most of the time if every octave took the same.
inline constexpr std::uint32_t last_common_order = 1u << 13;
inline constexpr double late_roulette_survival = 0.5;

// Exits less likely than this are tallied at random with this weight: unbiased, and the many deep
// flights that have next to no chance to leave cost one comparison.
inline constexpr double rare_exit = 0.02;
inline constexpr double rare_exit_distance = 3.912023005428146;  // exp of its negative is rare_exit

}  // namespace beamspread
