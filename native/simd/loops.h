// Inner loops over arrays, see base/platform.h.
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>

namespace beamspread {

// sum[i] += factor * values[i]
void add_scaled(float* sum, const float* values, float factor, std::size_t count);

void add_scaled(double* sum, const double* values, double factor, std::size_t count);

// Values of a block: `multiply_rows` has no remainders.
inline constexpr std::size_t values_per_block = 16;

// product[c * width + i] = sum over k of factors[c * count + k] * rows[k * width + i]; k below count, c below columns,
// i below width, a multiple of a block
void multiply_rows(float* product, const float* factors, const float* rows, std::size_t columns, std::size_t count,
                   std::size_t width);

// product[i] = factor * values[i]
void scale(float* product, const float* values, float factor, std::size_t count);

// product[i] = a[i] * b[i]
void multiply(float* product, const float* a, const float* b, std::size_t count);

// sum[i] += factor * a[i] * b[i]
void add_scaled_product(float* sum, const float* a, const float* b, float factor, std::size_t count);

// sum[i] += factor[i] * values[i]
void add_product(std::complex<float>* sum, const float* factor, const std::complex<float>* values, std::size_t count);

// result[f] = sum over k of weight[k] * table[k * stride + f], k = 0 .. 3
void interpolate(float* result, const float* table, std::size_t stride, const float* weight, std::size_t count);

// (cosine, sine)[i] turned by the angle of (cos_beta, sin_beta)[i]
void rotate(float* cosine, float* sine, const float* cos_beta, const float* sin_beta, std::size_t count);

// Where the tables of a function of tan(theta / 2) have that value: after this step, by this part of the next.
void find_steps(std::uint32_t* step, float* part, const float* half_tangent, float first, float per_step,
                std::uint32_t steps, std::size_t count);

// A table's value at a step, and from there to the next.
struct TableStep {
    float value;
    float rise;
};

// result[i] = the table interpolated between step[i] and step[i] + 1
void look_up(float* result, const TableStep* table, const std::uint32_t* step, const float* part, std::size_t count);

}  // namespace beamspread
