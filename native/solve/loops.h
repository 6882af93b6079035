// Inner loops of the solvers, see solve/target_clones.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "solve/fft.h"

namespace beamspread {

// sum[i] += factor * values[i]
void add_scaled(float* sum, const float* values, float factor, std::size_t count);

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
void add_product(Complex* sum, const float* factor, const Complex* values, std::size_t count);

// result[f] = sum over k of weight[k] * table[k * stride + f], k = 0 .. 3
void interpolate(float* result, const float* table, std::size_t stride, const float* weight, std::size_t count);

// (cosine, sine)[i] turned by the angle of (cos_beta, sin_beta)[i]
void turn(float* cosine, float* sine, const float* cos_beta, const float* sin_beta, std::size_t count);

// Azimuths beta and tan(theta / 2) of directions of travel, (x, y, z) after (x, y, z). Where the irradiance is
// zero the direction may be anything.
void find_angles(const float* directions, const float* irradiance, float* cos_beta, float* sin_beta,
                 float* half_tangent, std::size_t count);

// By how much the squared length of a direction may differ from 1: single-precision unit vectors are off by 1e-7; what
// is off by more was never normalized.
inline constexpr float unit_tolerance = 2e-3f;

// Whether these are beams: irradiance finite and >= 0, and where it is not zero a unit vector with z < 0.
bool are_beams(const float* irradiance, const float* directions, std::size_t count);

// Adds light that arrives along `directions`, (x, y, z) after (x, y, z): sum += irradiance, (x, y, z) += irradiance
// times direction; sets tan(theta / 2). Where the irradiance is zero the direction may be anything.
void add_light(float* sum, float* x, float* y, float* z, float* half_tangent, const float* irradiance,
               const float* directions, std::size_t count);

// sum[i] = the sum of values[4 i] to values[4 i + 3]
void add_fours(float* sum, const float* values, std::size_t count);

// Makes unit vectors of (x, y, z), zero stays zero, and sets how long they were and tan(theta / 2).
void make_unit(float* x, float* y, float* z, float* length, float* half_tangent, std::size_t count);

// Counts lit texels and widens the ranges [first, last] of their tan(theta / 2).
void add_lit(float* texels, float* first, float* last, const float* half_tangent, const float* irradiance,
             std::size_t count);

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
