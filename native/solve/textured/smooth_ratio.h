// The ratio of two noisy maps, smoothed as far as its noise asks for.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace beamspread {

// Sums of two independent halves of the paths, [half][texel].
struct PathSums {
    std::array<std::vector<float>, 2> textured;
    std::array<std::vector<float>, 2> plain;
};

// Writes a row of the factors that a ratio is multiplied by later, in whose units errors count.
using ScaleRow = std::function<void(std::size_t y, float* values)>;

// Gaussians by which the ratio of the sums is smoothed in each block of texels, and the error that they leave.
struct SmoothingChoice {
    std::vector<std::vector<float>> weights;  // [width][block]; those of a block add up to 1
    double error = 0.0;  // estimated root mean square of ratio x scale, over the root mean square of that
};

// Errors count where the light is, also where it is a spot.
SmoothingChoice choose_smoothing(const PathSums& sums, std::size_t width, const ScaleRow& scale);

// Calls take(y, ratio of the texels in row y) for each row, in any order, with the ratio textured / plain.
void smooth_ratio(PathSums sums, std::size_t width, const SmoothingChoice& choice,
                  const std::function<void(std::size_t y, const float* ratio)>& take);

// Estimated mean squared error of ratio x scale if all texels are smoothed by one Gaussian: without choices, which favor
// errors that are too low by chance.
double cost_of_smoothing(const PathSums& sums, std::size_t width, const ScaleRow& scale);

}  // namespace beamspread
