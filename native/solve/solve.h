// Luminance of light on a plane, by any solver.
#pragma once

#include "base/progress.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Writes (height, width, channels), radiance in W/(m^2 sr): the sum over all lights (Manabe et al. 2012, Eq. 2). The
// result does not depend on the number of threads. Throws InvalidArgument, Cancelled.
void solve(const Problem& problem, Progress& progress, float* luminance);

}  // namespace beamspread
