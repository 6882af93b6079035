// The terms of a low-rank basis that a plane's luminance needs.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/light_pyramid.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// A cheap choice of terms by which the luminance is off by at most `tolerance`, everywhere relative to the mean of the
// 17 x 17 texels around, and hence relative to its sum; beside some 1e-5 of the brightest texel.
//
// Errors of kernels cancel over light that varies smoothly and add up in the dark beside it, so the luminance decides,
// at some texels: what every term brings there is found first, and then terms are left out as long as all that is left
// out stays within a share of the tolerance. Small planes keep all.
std::vector<std::size_t> choose_terms(const KernelDecomposition& kernels, const std::vector<LightPyramid>& lights,
                                      double pitch_x, double pitch_y, double tolerance);

}  // namespace beamspread
