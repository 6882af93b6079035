// Gaussian smoothing of images.
#pragma once

#include <cstddef>
#include <vector>

namespace beamspread {

// Means of (height, width) values, weighted by a Gaussian of `sigma` texels (0: the values themselves) within the
// image.
std::vector<double> blur(const std::vector<double>& values, std::size_t width, std::size_t height, double sigma);

}  // namespace beamspread
