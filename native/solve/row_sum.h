// The innermost loop of the solvers that add beam after beam.
#pragma once

#include <cstddef>

namespace beamspread {

// sum[i] += factor * values[i].
void add_scaled(double* sum, const double* values, double factor, std::size_t count);

}  // namespace beamspread
