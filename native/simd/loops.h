// Inner loops over arrays, compiled for several instruction sets. All give the same bits.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>

namespace beamspread {

// sum[i] += factor * values[i]
void add_scaled(float* sum, const float* values, float factor, std::size_t count);

void add_scaled(double* sum, const double* values, double factor, std::size_t count);

// Values in a block: `multiply_rows` has no remainders.
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

// Position of each half tangent in a table of equal steps: the step before it, and the fraction of the next.
void find_steps(std::uint32_t* step, float* part, const float* half_tangent, float first, float per_step,
                std::uint32_t steps, std::size_t count);

// A table's value at a step, and its rise to the next.
struct TableStep {
    float value;
    float rise;
};

// result[f * count + i] = function f, interpolated between step[i] and step[i] + 1. Rows of the table are `stride` apart.
void look_up(float* result, std::size_t functions, const TableStep* table, std::size_t stride,
             const std::uint32_t* step, const float* part, std::size_t count);

// Harmonics in a block: loops over blocks have no remainders.
inline constexpr std::size_t harmonics_per_block = 8;

// cosine[m] = factor * cos(m angle), m below count, a multiple of a block; to some m roundings
void multiple_angles(float* cosine, float cos_angle, float sin_angle, float factor, std::size_t count);

// sum[i] += factor * values[i] * by_harmonic[first[i / 8] + i % 8], in blocks of harmonics
void add_harmonics(float* sum, const float* values, const float* by_harmonic, float factor, const std::size_t* first,
                   std::size_t blocks);

// Azimuths beta and tan(theta / 2) of directions of travel of any length, stored (x, y, z) after (x, y, z). Texels
// without irradiance may have any direction.
void find_angles(const float* directions, const float* irradiance, float* cos_beta, float* sin_beta,
                 float* half_tangent, std::size_t count);

// Rows and columns of targets that `add_sources` sums at a time.
inline constexpr std::size_t target_rows = 4;
inline constexpr std::ptrdiff_t target_columns = 16;

// Light of `target_rows` texels of column x.
struct LitColumn {
    std::ptrdiff_t x;
    std::array<double, target_rows> light;
};

// Adds the sources up to column `last` to the targets from column x on. Row k of the light goes to row k of `sums`; the
// kernel's row points at dx = 0.
void add_sources(double* const* sums, std::ptrdiff_t x, const LitColumn* source, std::ptrdiff_t last,
                 const double* kernel);

[[gnu::always_inline]] inline std::uint32_t reverse_bits(std::uint32_t value)
{
    value = value >> 16 | value << 16;
    value = (value & 0xff00ff00u) >> 8 | (value & 0x00ff00ffu) << 8;
    value = (value & 0xf0f0f0f0u) >> 4 | (value & 0x0f0f0f0fu) << 4;
    value = (value & 0xccccccccu) >> 2 | (value & 0x33333333u) << 2;
    return (value & 0xaaaaaaaau) >> 1 | (value & 0x55555555u) << 1;
}

// Hash in which each bit depends on the lower bits alone (Laine, Karras 2011, with the constants of Burley 2020).
[[gnu::always_inline]] inline std::uint32_t flip_upwards(std::uint32_t value, std::uint32_t seed)
{
    value ^= value * 0x3d20adeau;
    value += seed;
    value *= (seed >> 16) | 1u;
    value ^= value * 0x05526c56u;
    return value ^ value * 0x53a22864u;
}

// Writes one coordinate of a block's points to every second element of `result`. `block` is the digits of the block's
// first point, `offsets` those of the points relative to it.
void scatter_bits(double* result, const std::uint32_t* offsets, std::uint32_t block, std::uint32_t seed,
                  std::size_t count);

}  // namespace beamspread
