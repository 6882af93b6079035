// Light that crosses a slab without scattering, in closed form: Beer-Lambert attenuation and Fresnel reflections,
// summed as a geometric series.
#pragma once

#include <vector>

#include "medium/medium.h"
#include "transport/tally/tally.h"

namespace beamspread {

// An exit of the beam: a delta function of exitance at (u, 0).
struct BallisticExit {
    double u = 0.0;      // mean free paths from the point of entry, along the beam's direction
    double power = 0.0;  // per unit power that entered
};

// Exits of the unscattered beam through one side, nearest first, until less than 1e-9 of the power is left inside.
// Empty for a half-space.
std::vector<BallisticExit> ballistic_exits(const Medium& medium, double theta_inside, Side side);

// Total power of all exits through one side.
double ballistic_total(const Medium& medium, double theta_inside, Side side);

}  // namespace beamspread
