// The direct solver (Manabe et al. 2012, Eq. 2): one beam per lit texel, one kernel value per pair of texels. It is the
// reference for the other solvers.
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Exitance of one medium under a light of colour 1, W/m^2, row by row. Advances the progress by 1.
std::vector<double> solve_direct(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                 Progress& progress);

}  // namespace beamspread
