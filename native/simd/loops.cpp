#include "simd/loops.h"

#include <array>
#include <cstring>

#include "base/platform.h"

namespace beamspread {

BEAMSPREAD_CLONES void add_scaled(float* __restrict sum, const float* values, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

BEAMSPREAD_CLONES void add_scaled(double* sum, const double* values, double factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

BEAMSPREAD_CLONES void multiply_rows(float* __restrict product, const float* factors, const float* rows,
                                     std::size_t columns, std::size_t count, std::size_t width)
{
    using Values = float __attribute__((vector_size(values_per_block * sizeof(float))));
    // As many as keep an adder busy and fit into registers; what is read of the rows serves all.
    constexpr std::size_t at_once = 4;
    for (std::size_t first = 0; first < columns; first += at_once) {
        std::array<const float*, at_once> factor;
        for (std::size_t c = 0; c < at_once; ++c)
            factor[c] = factors + (first + c < columns ? first + c : first) * count;
        for (std::size_t i = 0; i < width; i += values_per_block) {
            std::array<Values, at_once> sums{};
            for (std::size_t k = 0; k < count; ++k) {
                Values row;
                std::memcpy(&row, rows + k * width + i, sizeof(row));
                for (std::size_t c = 0; c < at_once; ++c)
                    sums[c] += factor[c][k] * row;
            }
            for (std::size_t c = 0; c < at_once && first + c < columns; ++c)
                std::memcpy(product + (first + c) * width + i, &sums[c], sizeof(Values));
        }
    }
}

BEAMSPREAD_CLONES void scale(float* __restrict product, const float* values, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        product[i] = factor * values[i];
}

BEAMSPREAD_CLONES void multiply(float* __restrict product, const float* a, const float* b, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        product[i] = a[i] * b[i];
}

BEAMSPREAD_CLONES void add_scaled_product(float* __restrict sum, const float* a, const float* b, float factor,
                                          std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * (a[i] * b[i]);
}

BEAMSPREAD_CLONES void add_product(std::complex<float>* sum, const float* factor, const std::complex<float>* values,
                                   std::size_t count)
{
    // std::complex is two floats by definition ([complex.numbers]).
    auto* s = reinterpret_cast<float*>(sum);
    const auto* v = reinterpret_cast<const float*>(values);
    for (std::size_t i = 0; i < count; ++i) {
        s[2 * i] += factor[i] * v[2 * i];
        s[2 * i + 1] += factor[i] * v[2 * i + 1];
    }
}

BEAMSPREAD_CLONES void interpolate(float* __restrict result, const float* table, std::size_t stride,
                                   const float* weight, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        result[i] = weight[0] * table[i] + weight[1] * table[stride + i] + weight[2] * table[2 * stride + i] +
                    weight[3] * table[3 * stride + i];
}

BEAMSPREAD_CLONES void rotate(float* __restrict cosine, float* __restrict sine, const float* cos_beta,
                              const float* sin_beta, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const float next = cosine[i] * cos_beta[i] - sine[i] * sin_beta[i];
        sine[i] = sine[i] * cos_beta[i] + cosine[i] * sin_beta[i];
        cosine[i] = next;
    }
}

BEAMSPREAD_CLONES void find_steps(std::uint32_t* __restrict step, float* __restrict part, const float* half_tangent,
                                  float first, float per_step, std::uint32_t steps, std::size_t count)
{
    const auto end = static_cast<float>(steps);
    const auto last = static_cast<std::int32_t>(steps - 1);
    for (std::size_t i = 0; i < count; ++i) {
        const float unbounded = (half_tangent[i] - first) * per_step;
        const float above = unbounded > 0.0f ? unbounded : 0.0f;
        const float place = above < end ? above : end;
        const auto whole = static_cast<std::int32_t>(place);
        const std::int32_t before = whole < last ? whole : last;
        step[i] = static_cast<std::uint32_t>(before);
        part[i] = place - static_cast<float>(before);
    }
}

// Pairs are loaded at once, faster than any gather.
void look_up(float* __restrict result, const TableStep* table, const std::uint32_t* step, const float* part,
             std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const TableStep& at = table[step[i]];
        result[i] = at.value + part[i] * at.rise;
    }
}

}  // namespace beamspread
