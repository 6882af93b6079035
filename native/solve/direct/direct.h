// The direct solver: one beam per lit texel, one kernel value per pair of texels. The truth for the other solvers.
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Exitance that a light of colour 1 causes over one medium, W/m^2, row by row; advances the progress by 1.
std::vector<double> solve_direct(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                 Progress& progress);

}  // namespace beamspread
