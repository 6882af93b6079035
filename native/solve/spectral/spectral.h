// The fft solver: the direct solver's sums as products of spectra.
#pragma once

#include <cstddef>

#include "base/progress.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Padded so that light that leaves the plane does not come back. Writes (height, width, channels) in W/(m^2 sr).
void solve_spectral(const Problem& problem, Progress& progress, float* luminance);

// How many terms of the light it transforms; what is solved costs in proportion to them.
std::size_t count_terms(const Problem& problem, Progress& progress);

}  // namespace beamspread
