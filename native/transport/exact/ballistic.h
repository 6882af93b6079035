// Light that crosses a slab without a single scattering, in closed form.
#pragma once

#include <vector>

#include "medium/medium.h"
#include "transport/tally/tally.h"

namespace beamspread {

// A delta function of exitance at (u, 0).
struct BallisticExit {
    double u = 0.0;      // mean free paths from the point of entry, along the beam's direction
    double power = 0.0;  // per unit power that entered
};

// Exits of the unscattered beam through one side, nearest first, until less than 1e-9 of the power
// is left. Empty for a half-space.
std::vector<BallisticExit> ballistic_exits(const Medium& medium, double theta_inside, Side side);

// Their total, in closed form.
double ballistic_total(const Medium& medium, double theta_inside, Side side);

}  // namespace beamspread
