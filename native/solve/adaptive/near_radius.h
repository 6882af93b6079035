// How near to a beam it must be seen as finely as it is.
#pragma once

#include <vector>

#include "base/progress.h"
#include "ldf/radial/radial_profile.h"

namespace beamspread {

// Below, in points of a grid, the window's own shape is too much for the interpolation. Errors with 4 and 16 differ by
// no more than 2e-5 of the light, the time by 10 %.
inline constexpr double least_near_radius = 8.0;

// Beams of about one angle.
struct AngleLight {
    RadialProfile profile;
    double power = 0.0;
};

// The near radius in points of a level's grid by which the absolute errors of a multilevel sum, of all beams in all texels,
// add up to at most the fraction `allowed` of the light that comes back within a distance. Lengths in mean free paths.
double near_radius(const std::vector<AngleLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress);

}  // namespace beamspread
