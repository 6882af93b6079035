// The ratio of two noisy maps, smoothed as far as its noise asks for.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/view.h"

namespace beamspread {

// Sums of two independent halves of the paths, [half][texel].
struct PathSums {
    std::array<std::vector<float>, 2> textured;
    std::array<std::vector<float>, 2> plain;
};

// Writes the ratio textured / plain of each texel. `scale`: what it is multiplied by later, rows contiguous; errors count
// in its units. Returns the estimated root mean square error of ratio x scale, over the root mean square of that: errors
// count where the light is, also where it is a spot.
double smooth_ratio(const PathSums& sums, const View2D<const float>& scale, std::vector<float>& ratio);

// Estimated mean squared error of ratio x scale if all texels are smoothed by one Gaussian: without choices, which favor
// errors that are too low by chance.
double cost_of_smoothing(const PathSums& sums, const View2D<const float>& scale);

}  // namespace beamspread
