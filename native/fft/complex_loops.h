// Inner loops over complex numbers, see base/platform.h.
#pragma once

#include <cstddef>

#include "fft/fft.h"

namespace beamspread {

// sum[i] += factor[i] * values[i]
void add_product(Complex* sum, const float* factor, const Complex* values, std::size_t count);

}  // namespace beamspread
