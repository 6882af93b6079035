// Inner loops of the fft solver, compiled for several instruction sets, the best chosen at run time. Without
// contraction to fused multiply-add the results are the same for all.
#pragma once

#include <cstddef>
#include <cstdint>

#include "solve/fft.h"

namespace beamspread {

// sum[i] += factor * values[i]
void add_scaled(float* sum, const float* values, float factor, std::size_t count);

// product[i] = factor * values[i]
void scale(float* product, const float* values, float factor, std::size_t count);

// sum[i] += factor * a[i] * b[i]
void add_scaled_product(float* sum, const float* a, const float* b, float factor, std::size_t count);

// sum[i] += factor * values[i] * by_column[columns[i / size] + i % size], in blocks of this size
void add_scaled_columns(float* sum, const float* values, const float* by_column, float factor,
                        const std::size_t* columns, std::size_t size, std::size_t blocks);

// result[m] = cos(m angle) of cosine = cos(angle), m below count >= 2, to some m^2 roundings
void multiple_angles(float* result, float cosine, std::size_t count);

// product[i] = a[i] * b[i]
void multiply(float* product, const float* a, const float* b, std::size_t count);

// sum[i] += factor[i] * values[i]
void add_product(Complex* sum, const float* factor, const Complex* values, std::size_t count);

// result[f] = sum over k of weight[k] * table[k * stride + f], k = 0 .. 3
void interpolate(float* result, const float* table, std::size_t stride, const float* weight, std::size_t count);

// (cosine, sine)[i] turned by the angle of (cos_beta, sin_beta)[i]
void turn(float* cosine, float* sine, const float* cos_beta, const float* sin_beta, std::size_t count);

// Azimuths beta and tan(theta / 2) of directions of travel, (x, y, z) after (x, y, z). Where the irradiance is
// zero the direction may be anything.
void find_angles(const float* directions, const float* irradiance, float* cos_beta, float* sin_beta,
                 float* half_tangent, std::size_t count);

// A table's value at a step, and from there to the next.
struct TableStep {
    float value;
    float rise;
};

// result[i] = the table interpolated between step[i] and step[i] + 1
void look_up(float* result, const TableStep* table, const std::uint32_t* step, const float* part, std::size_t count);

}  // namespace beamspread
