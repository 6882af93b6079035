// How near to a beam it must be seen as finely as it is.
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/adaptive/multilevel_kernel.h"

namespace beamspread {

// A kernel and the light that it spreads.
struct SpreadLight {
    const RadialProfile* profile;
    HarmonicSum kernel;
    double sum = 0.0;
    double absolute_sum = 0.0;
};

// The near radius in points of a level's grid by which the errors of a multilevel sum, in all texels together, are at most
// the fraction `allowed` of the light that comes back within a distance. Lengths in mean free paths.
double near_radius(const std::vector<SpreadLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress);

}  // namespace beamspread
