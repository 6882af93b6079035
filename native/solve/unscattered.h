// What all solvers leave out, as it has no place in a smooth kernel.
#pragma once

#include "solve/problem/problem.h"

namespace beamspread {

// Light that a slab with an ior above 1 returns unscattered from its far boundary; adds to (height, width, channels).
void add_unscattered(const Problem& problem, float* luminance);

}  // namespace beamspread
