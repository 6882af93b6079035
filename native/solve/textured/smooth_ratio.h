// The ratio of two noisy maps, smoothed as far as its noise asks for.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace beamspread {

// Sums of two independent halves of the paths, [half][texel].
struct PathSums {
    std::array<std::vector<float>, 2> textured;
    std::array<std::vector<float>, 2> plain;
};

// Writes the ratio textured / plain of each texel. `scale`: what it is multiplied by later; errors count in its units.
// Returns the estimated root mean square error of ratio x scale, over the mean of that.
double smooth_ratio(const PathSums& sums, const std::vector<float>& scale, std::size_t width, std::size_t height,
                    std::vector<float>& ratio);

// Estimated mean squared error of ratio x scale if all texels are smoothed by one Gaussian: without choices, which favor
// errors that are too low by chance.
double cost_of_smoothing(const PathSums& sums, const std::vector<float>& scale, std::size_t width, std::size_t height);

}  // namespace beamspread
