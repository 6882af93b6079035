// Choice of the terms of a low-rank basis that a plane's radiance needs.
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "solve/separable/light_terms.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Chooses few terms with which the radiance is off by at most `tolerance`, everywhere relative to the mean of the 17 x
// 17 texels around (and hence relative to its sum), besides some 1e-5 of the brightest texel.
//
// Errors of kernels cancel over smooth light and add up in the dark beside it, hence the radiance at probed texels
// decides: every term's part of it is computed, then terms are dropped while the sum of all dropped parts stays within
// a fraction of the tolerance. Small planes keep all terms. Without light, the error of the kernels decides. Smooth light
// adds terms of its own. Advances the progress by `work`.
std::vector<std::size_t> choose_terms(const KernelDecomposition& kernels, const Incidence& incidence,
                                      const LightTerms& light, const ComingLight& coming, double tolerance,
                                      Progress& progress, double work);

// Chooses few terms with which the radiance of smooth light is off by a fraction of `tolerance`, root mean square and
// relative to all light. Its moments tell which terms it needs.
std::vector<std::size_t> smooth_terms(const KernelDecomposition& kernels, const ComingLight& coming, double tolerance);

}  // namespace beamspread
