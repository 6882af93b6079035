// Rows of smoothed ratios and of their errors, compiled for several instruction sets; all give the same bits.
#pragma once

#include <cstddef>
#include <span>

namespace beamspread {

// sum[i] = sum over k of weights[k] * rows[k][i]
void sum_rows(float* sum, std::span<const float* const> rows, std::span<const float> weights, std::size_t count);

// ratio[i] = textured[i] / plain[i] where that is above 0, else otherwise[i]
void divide_rows(float* ratio, const float* textured, const float* plain, const float* otherwise, std::size_t count);

// sum[i] = a[i] + b[i]; the sum may be one of them.
void add_rows(float* sum, const float* a, const float* b, std::size_t count);

// A row of the ratios of both halves.
struct HalfRows {
    const float* first;
    const float* second;
};

// Adds estimates of squared errors of texels, in units of scale x ratio: `cost` of blur and noise, `variance` of noise.
void add_errors(float* cost, float* variance, const HalfRows& smooth, const HalfRows& fine, const float* scale,
                std::size_t count);

}  // namespace beamspread
