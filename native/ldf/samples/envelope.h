// Smoothing of noisy images.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/samples/ldf_sample.h"

namespace beamspread {

// Gaussian blur of (height, width) values with a standard deviation of `sigma` texels (0: none). At borders the weights
// inside the image are normalized.
std::vector<double> blur(const std::vector<double>& values, std::size_t width, std::size_t height, double sigma);

// Smooth positive version of an LDF's image, whose logarithm is hardly noisy.
struct Envelope {
    std::vector<double> value;     // nowhere 0
    std::vector<double> variance;  // of the image's noise in one texel, relative to the value squared
};

// The image itself where its relative noise is below 10 %. Elsewhere m blur(image) / blur(m), with m the mean over
// rings around O and the narrowest blur that brings the noise below 10 %; the division by blur(m) compensates a steep
// decline. m declines exponentially beyond the last light. The image's odd part in v, which an LDF lacks, estimates the
// noise: a library's image stays unchanged.

Envelope envelope(const LdfSample& sample);

}  // namespace beamspread
