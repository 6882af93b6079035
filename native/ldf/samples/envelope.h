// Smoothing of noisy images.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/samples/ldf_sample.h"

namespace beamspread {

// Means of (height, width) values, weighted by a Gaussian of `sigma` texels (0: the values themselves) within the
// image.
std::vector<double> blur(const std::vector<double>& values, std::size_t width, std::size_t height, double sigma);

// The image where its relative noise is below 10 %. Elsewhere m blur(image) / blur(m), with m the mean over rings
// around O: averages over as few texels as bring the noise below 10 %, which a steep decline doesn't shift as m has it
// too. Farther out than light was seen m declines exponentially. The noise is that of the part odd in v, which an LDF
// hasn't: a library's image stays as it is.
struct Envelope {
    std::vector<double> value;     // nowhere 0
    std::vector<double> variance;  // of the image's noise in one texel, relative to the value squared
};

Envelope envelope(const LdfSample& sample);

}  // namespace beamspread
