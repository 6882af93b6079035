// Reflectance and transmittance without noise: of light that crosses a slab without scattering, in closed form, and of
// all light, by discrete ordinates and doubling of layers.
#pragma once

#include <span>
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

// Power that leaves each side per unit incident power, [angle][albedo]. Includes unscattered light, excludes specular
// reflection at entry, as LdfLibrary::total.
struct ExactTotals {
    std::vector<double> reflectance;
    std::vector<double> transmittance;
};

// Computes the totals for angles in degrees outside, [0, 90), and albedos in [0, 1). For |g| <= .95 and angles up to 88
// degrees they converge to a relative 1.2e-4 plus 3e-7, and mostly far better. Throws InvalidArgument.
ExactTotals exact_totals(const Medium& medium, std::span<const double> angles_deg, std::span<const double> albedos,
                         int threads);

// Bound of the relative error from the phase function's omitted coefficients and the quadrature.
double exact_totals_error(const Medium& medium);

}  // namespace beamspread
