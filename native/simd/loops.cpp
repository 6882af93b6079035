// Every loop is compiled for each target of Highway, which chooses the best at run time. The compiler vectorizes plain
// code; without contraction to fused multiply-add the results are the same for all targets.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/loops.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "simd/loops.h"
#include "simd/wide-inl.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

void add_scaled(float* __restrict sum, const float* values, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

void add_scaled_double(double* sum, const double* values, double factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

void multiply_rows(float* __restrict product, const float* factors, const float* rows, std::size_t columns,
                   std::size_t count, std::size_t width)
{
    using Values = Wide<values_per_block>;
    // Columns per pass: enough to keep an adder busy, few enough for registers. Each row is read once per pass.
    constexpr std::size_t at_once = 4;
    for (std::size_t first = 0; first < columns; first += at_once) {
        std::array<const float*, at_once> factor;
        for (std::size_t c = 0; c < at_once; ++c)
            factor[c] = factors + (first + c < columns ? first + c : first) * count;
        for (std::size_t i = 0; i < width; i += values_per_block) {
            std::array<Values, at_once> sums{};
            for (std::size_t k = 0; k < count; ++k) {
                Values row;
                row.load(rows + k * width + i);
                for (std::size_t c = 0; c < at_once; ++c)
                    sums[c] += factor[c][k] * row;
            }
            for (std::size_t c = 0; c < at_once && first + c < columns; ++c)
                sums[c].store(product + (first + c) * width + i);
        }
    }
}

void scale(float* __restrict product, const float* values, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        product[i] = factor * values[i];
}

void multiply(float* __restrict product, const float* a, const float* b, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        product[i] = a[i] * b[i];
}

void add_scaled_product(float* __restrict sum, const float* a, const float* b, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * (a[i] * b[i]);
}

void add_product(std::complex<float>* sum, const float* factor, const std::complex<float>* values, std::size_t count)
{
    // std::complex is two floats by definition ([complex.numbers]).
    auto* s = reinterpret_cast<float*>(sum);
    const auto* v = reinterpret_cast<const float*>(values);
    for (std::size_t i = 0; i < count; ++i) {
        s[2 * i] += factor[i] * v[2 * i];
        s[2 * i + 1] += factor[i] * v[2 * i + 1];
    }
}

void interpolate(float* __restrict result, const float* table, std::size_t stride, const float* weight,
                 std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        result[i] = weight[0] * table[i] + weight[1] * table[stride + i] + weight[2] * table[2 * stride + i] +
                    weight[3] * table[3 * stride + i];
}

void rotate(float* __restrict cosine, float* __restrict sine, const float* cos_beta, const float* sin_beta,
            std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const float next = cosine[i] * cos_beta[i] - sine[i] * sin_beta[i];
        sine[i] = sine[i] * cos_beta[i] + cosine[i] * sin_beta[i];
        cosine[i] = next;
    }
}

void find_steps(std::uint32_t* __restrict step, float* __restrict part, const float* half_tangent, float first,
                float per_step, std::uint32_t steps, std::size_t count)
{
    const auto end = static_cast<float>(steps);
    const auto last = static_cast<std::int32_t>(steps - 1);
    for (std::size_t i = 0; i < count; ++i) {
        const float unbounded = (half_tangent[i] - first) * per_step;
        const float above = unbounded > 0.0f ? unbounded : 0.0f;
        const float position = above < end ? above : end;
        const auto whole = static_cast<std::int32_t>(position);
        const std::int32_t before = whole < last ? whole : last;
        step[i] = static_cast<std::uint32_t>(before);
        part[i] = position - static_cast<float>(before);
    }
}

using Block = float __attribute__((vector_size(harmonics_per_block * sizeof(float))));

[[gnu::always_inline]] inline void rotate_block(Block& cosine, Block& sine, const Block& by_cos, const Block& by_sin)
{
    const Block next = cosine * by_cos - sine * by_sin;
    sine = sine * by_cos + cosine * by_sin;
    cosine = next;
}

void multiple_angles(float* cosine, float cos_angle, float sin_angle, float factor, std::size_t count)
{
    // Angles i times the angle, bit by bit of i: few steps, each for a whole block.
    constexpr std::array<Block, 3> bits = {Block{0, 1, 0, 1, 0, 1, 0, 1}, Block{0, 0, 1, 1, 0, 0, 1, 1},
                                           Block{0, 0, 0, 0, 1, 1, 1, 1}};
    Block cos_m = Block{} + factor;
    Block sin_m{};
    for (const Block& bit : bits) {
        rotate_block(cos_m, sin_m, 1.0f + bit * (cos_angle - 1.0f), bit * sin_angle);
        const float twice = 2.0f * cos_angle * sin_angle;
        cos_angle = cos_angle * cos_angle - sin_angle * sin_angle;
        sin_angle = twice;
    }
    for (std::size_t m = 0; m < count; m += harmonics_per_block) {
        std::memcpy(cosine + m, &cos_m, sizeof(cos_m));
        rotate_block(cos_m, sin_m, Block{} + cos_angle, Block{} + sin_angle);
    }
}

void add_harmonics(float* __restrict sum, const float* values, const float* by_harmonic, float factor,
                   const std::size_t* first, std::size_t blocks)
{
    for (std::size_t block = 0; block < blocks; ++block) {
        const float* harmonics = by_harmonic + first[block];
        for (std::size_t i = 0; i < harmonics_per_block; ++i)
            sum[i] += factor * values[i] * harmonics[i];
        sum += harmonics_per_block;
        values += harmonics_per_block;
    }
}

// Direction of a texel's light; straight down where the texel is dark.
struct Travel {
    float x, y, z;
};

[[gnu::always_inline]] inline Travel travel_of(const float* direction, float irradiance)
{
    const bool lit = irradiance != 0.0f;
    const float x = direction[0];
    const float y = direction[1];
    const float z = direction[2];
    return {lit ? x : 0.0f, lit ? y : 0.0f, lit ? z : -1.0f};
}

void find_angles(const float* directions, const float* irradiance, float* __restrict cos_beta,
                 float* __restrict sin_beta, float* __restrict half_tangent, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const auto [x, y, z] = travel_of(directions + 3 * i, irradiance[i]);
        const float across = std::sqrt(x * x + y * y);
        const float length = std::sqrt(x * x + y * y + z * z);
        const bool slants = across > 0.0f;
        const float per_across = 1.0f / (slants ? across : 1.0f);
        cos_beta[i] = slants ? x * per_across : 1.0f;
        sin_beta[i] = y * per_across;
        half_tangent[i] = across / (length - z);
    }
}

// A vector of the target's size at any address of doubles. GCC keeps larger ones in memory.
constexpr std::size_t lanes_bytes = std::max<std::size_t>(HWY_MAX_BYTES, 16);
using Lanes = double __attribute__((vector_size(lanes_bytes), aligned(8), may_alias));
constexpr auto columns_at_once = static_cast<std::ptrdiff_t>(2 * sizeof(Lanes) / sizeof(double));
static_assert(target_columns % columns_at_once == 0);

// Adds to the sums of `columns_at_once` columns from x on.
[[gnu::always_inline]] inline void add_sources_at(double* const* sums, std::ptrdiff_t x, const LitColumn* source,
                                                  std::ptrdiff_t last, const double* kernel)
{
    static_assert(target_rows == 4);
    auto* to0 = reinterpret_cast<Lanes*>(sums[0] + x);
    auto* to1 = reinterpret_cast<Lanes*>(sums[1] + x);
    auto* to2 = reinterpret_cast<Lanes*>(sums[2] + x);
    auto* to3 = reinterpret_cast<Lanes*>(sums[3] + x);
    Lanes left0 = to0[0], right0 = to0[1];
    Lanes left1 = to1[0], right1 = to1[1];
    Lanes left2 = to2[0], right2 = to2[1];
    Lanes left3 = to3[0], right3 = to3[1];
    for (; source->x <= last; ++source) {
        const auto* values = reinterpret_cast<const Lanes*>(kernel + (x - source->x));
        const Lanes left = values[0];
        const Lanes right = values[1];
        left0 += source->light[0] * left;
        right0 += source->light[0] * right;
        left1 += source->light[1] * left;
        right1 += source->light[1] * right;
        left2 += source->light[2] * left;
        right2 += source->light[2] * right;
        left3 += source->light[3] * left;
        right3 += source->light[3] * right;
    }
    to0[0] = left0;
    to0[1] = right0;
    to1[0] = left1;
    to1[1] = right1;
    to2[0] = left2;
    to2[1] = right2;
    to3[0] = left3;
    to3[1] = right3;
}

void add_sources(double* const* sums, std::ptrdiff_t x, const LitColumn* source, std::ptrdiff_t last,
                 const double* kernel)
{
    for (std::ptrdiff_t column = 0; column < target_columns; column += columns_at_once)
        add_sources_at(sums, x + column, source, last, kernel);
}

void scatter_bits(double* __restrict result, const std::uint32_t* offsets, std::uint32_t block, std::uint32_t seed,
                  std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t scrambled = reverse_bits(flip_upwards(block ^ offsets[i], seed));
        result[2 * i] = (scrambled + 0.5) * 0x1.0p-32;
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

// Defines a function that calls the loop of that name for the best target.
#define BEAMSPREAD_DISPATCH(name, parameters, arguments)                       \
    HWY_EXPORT(name);                                                          \
    void name parameters                                                       \
    {                                                                          \
        /* NOLINTNEXTLINE(bugprone-macro-parentheses): they have their own. */ \
        HWY_DYNAMIC_DISPATCH(name) arguments;                                  \
    }

BEAMSPREAD_DISPATCH(add_scaled, (float* sum, const float* values, float factor, std::size_t count),
                    (sum, values, factor, count))

HWY_EXPORT(add_scaled_double);
void add_scaled(double* sum, const double* values, double factor, std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(add_scaled_double)(sum, values, factor, count);
}

BEAMSPREAD_DISPATCH(multiply_rows,
                    (float* product, const float* factors, const float* rows, std::size_t columns, std::size_t count,
                     std::size_t width),
                    (product, factors, rows, columns, count, width))

BEAMSPREAD_DISPATCH(scale, (float* product, const float* values, float factor, std::size_t count),
                    (product, values, factor, count))

BEAMSPREAD_DISPATCH(multiply, (float* product, const float* a, const float* b, std::size_t count),
                    (product, a, b, count))

BEAMSPREAD_DISPATCH(add_scaled_product, (float* sum, const float* a, const float* b, float factor, std::size_t count),
                    (sum, a, b, factor, count))

BEAMSPREAD_DISPATCH(add_product,
                    (std::complex<float> * sum, const float* factor, const std::complex<float>* values,
                     std::size_t count),
                    (sum, factor, values, count))

BEAMSPREAD_DISPATCH(interpolate,
                    (float* result, const float* table, std::size_t stride, const float* weight, std::size_t count),
                    (result, table, stride, weight, count))

BEAMSPREAD_DISPATCH(rotate,
                    (float* cosine, float* sine, const float* cos_beta, const float* sin_beta, std::size_t count),
                    (cosine, sine, cos_beta, sin_beta, count))

BEAMSPREAD_DISPATCH(find_steps,
                    (std::uint32_t* step, float* part, const float* half_tangent, float first, float per_step,
                     std::uint32_t steps, std::size_t count),
                    (step, part, half_tangent, first, per_step, steps, count))

BEAMSPREAD_DISPATCH(multiple_angles, (float* cosine, float cos_angle, float sin_angle, float factor, std::size_t count),
                    (cosine, cos_angle, sin_angle, factor, count))

BEAMSPREAD_DISPATCH(add_harmonics,
                    (float* sum, const float* values, const float* by_harmonic, float factor, const std::size_t* first,
                     std::size_t blocks),
                    (sum, values, by_harmonic, factor, first, blocks))

BEAMSPREAD_DISPATCH(find_angles,
                    (const float* directions, const float* irradiance, float* cos_beta, float* sin_beta,
                     float* half_tangent, std::size_t count),
                    (directions, irradiance, cos_beta, sin_beta, half_tangent, count))

BEAMSPREAD_DISPATCH(add_sources,
                    (double* const* sums, std::ptrdiff_t x, const LitColumn* source, std::ptrdiff_t last,
                     const double* kernel),
                    (sums, x, source, last, kernel))

BEAMSPREAD_DISPATCH(scatter_bits,
                    (double* result, const std::uint32_t* offsets, std::uint32_t block, std::uint32_t seed,
                     std::size_t count),
                    (result, offsets, block, seed, count))

#undef BEAMSPREAD_DISPATCH

// Not vectorized: one load of a pair is faster than a gather.
void look_up(float* __restrict result, std::size_t functions, const TableStep* table, std::size_t stride,
             const std::uint32_t* step, const float* part, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const TableStep* const row = table + step[i] * stride;
        for (std::size_t f = 0; f < functions; ++f)
            result[f * count + i] = row[f].value + part[i] * row[f].rise;
    }
}

}  // namespace beamspread
#endif
