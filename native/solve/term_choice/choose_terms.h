// The terms of a low-rank basis that a plane's radiance needs.
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "solve/separable/incidence.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// A cheap choice of terms by which the radiance is off by at most `tolerance`, everywhere relative to the mean of the
// 17 x 17 texels around, and hence relative to its sum; beside some 1e-5 of the brightest texel.
//
// Errors of kernels cancel over light that varies smoothly and add up in the dark beside it, so the radiance decides,
// at some texels: what every term brings there is found first, and then terms are left out as long as all that is left
// out stays within a share of the tolerance. Small planes keep all. Without any light to look at, the kernels decide: they
// are off by `tolerance`. Advances the progress by `work`.
std::vector<std::size_t> choose_terms(const KernelDecomposition& kernels, const Incidence& incidence,
                                      const LightTerms& light, double tolerance, Progress& progress, double work);

}  // namespace beamspread
