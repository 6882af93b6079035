// Compiled for each target of Highway like simd/loops.cpp: plain code that the compiler vectorizes, without contraction,
// gives the same bits on all targets.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solve/textured/ratio_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <array>

#include "simd/wide-inl.h"
#include "solve/textured/ratio_rows.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

constexpr std::size_t lanes = 16;
using Values = Wide<lanes>;

void sum_rows(float* sum, std::span<const float* const> rows, std::span<const float> weights, std::size_t count)
{
    // Sums in registers, enough of them to keep an adder busy.
    constexpr std::size_t at_once = 4;
    std::size_t i = 0;
    for (; i + at_once * lanes <= count; i += at_once * lanes) {
        std::array<Values, at_once> sums{};
        for (std::size_t k = 0; k < rows.size(); ++k) {
#pragma GCC unroll 4
            for (std::size_t v = 0; v < at_once; ++v) {
                Values row;
                row.load(rows[k] + i + v * lanes);
                sums[v] += weights[k] * row;
            }
        }
#pragma GCC unroll 4
        for (std::size_t v = 0; v < at_once; ++v)
            sums[v].store(sum + i + v * lanes);
    }
    for (; i < count; ++i) {
        float one = 0.0f;
        for (std::size_t k = 0; k < rows.size(); ++k)
            one += weights[k] * rows[k][i];
        sum[i] = one;
    }
}

void divide_rows(float* __restrict ratio, const float* textured, const float* plain, const float* otherwise,
                 std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const float divisor = plain[i] > 0.0f ? plain[i] : 1.0f;
        const float quotient = textured[i] / divisor;
        ratio[i] = plain[i] > 0.0f ? quotient : otherwise[i];
    }
}

void add_rows(float* sum, const float* a, const float* b, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] = a[i] + b[i];
}

void add_errors(float* __restrict cost, float* __restrict variance, const HalfRows& smooth, const HalfRows& fine,
                const float* scale, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        // The squared blur, and the variance of the mean of both halves (Rousselle, Manzi, Zwicker 2013): half of one
        // half's, 1/2 (r0 - r1)^2, is left, and a half differs from the other finest one by the blur and the variance of
        // both.
        const float one = scale[i] * (smooth.first[i] - fine.second[i]);
        const float other = scale[i] * (smooth.second[i] - fine.first[i]);
        const float halves = scale[i] * (smooth.first[i] - smooth.second[i]);
        const float finest = scale[i] * (fine.first[i] - fine.second[i]);
        const float left = 0.25f * (halves * halves);
        cost[i] += 0.5f * (one * one + other * other - finest * finest) - left;
        variance[i] += left;
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

HWY_EXPORT(sum_rows);
HWY_EXPORT(divide_rows);
HWY_EXPORT(add_rows);
HWY_EXPORT(add_errors);

void sum_rows(float* sum, std::span<const float* const> rows, std::span<const float> weights, std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(sum_rows)(sum, rows, weights, count);
}

void divide_rows(float* ratio, const float* textured, const float* plain, const float* otherwise, std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(divide_rows)(ratio, textured, plain, otherwise, count);
}

void add_rows(float* sum, const float* a, const float* b, std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(add_rows)(sum, a, b, count);
}

void add_errors(float* cost, float* variance, const HalfRows& smooth, const HalfRows& fine, const float* scale,
                std::size_t count)
{
    HWY_DYNAMIC_DISPATCH(add_errors)(cost, variance, smooth, fine, scale, count);
}

}  // namespace beamspread
#endif
