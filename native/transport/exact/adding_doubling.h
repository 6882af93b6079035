// Totals without noise: discrete ordinates and doubling of layers.
#pragma once

#include <span>
#include <vector>

#include "medium/medium.h"

namespace beamspread {

// Power that leaves each side per unit power incident, [angle][albedo]: unscattered light included, specular
// reflection at entry excluded, as LdfLibrary::total has it.
struct ExactTotals {
    std::vector<double> reflectance;
    std::vector<double> transmittance;
};

// Angles in degrees outside, [0, 90), albedos in [0, 1). Converged to 1.2e-4 of each value besides 3e-7, and mostly far
// better, for -.95 <= g <= .95 and angles up to 88 degrees. Throws InvalidArgument.
ExactTotals exact_totals(const Medium& medium, std::span<const double> angles_deg, std::span<const double> albedos,
                         int threads);

// Bound of their relative error from the phase function's missing coefficients and the quadrature.
double exact_totals_error(const Medium& medium);

}  // namespace beamspread
