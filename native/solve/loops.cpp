#include "solve/loops.h"

#include <cmath>

#define BEAMSPREAD_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))

namespace beamspread {

BEAMSPREAD_CLONES void add_scaled(float* __restrict sum, const float* values, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

BEAMSPREAD_CLONES void scale(float* __restrict product, const float* values, float factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        product[i] = factor * values[i];
}

BEAMSPREAD_CLONES void add_scaled_product(float* __restrict sum, const float* a, const float* b, float factor,
                                          std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * (a[i] * b[i]);
}

BEAMSPREAD_CLONES void add_scaled_columns(float* __restrict sum, const float* values, const float* by_column,
                                          float factor, const std::size_t* columns, std::size_t size,
                                          std::size_t blocks)
{
    for (std::size_t block = 0; block < blocks; ++block) {
        const float* column = by_column + columns[block];
        for (std::size_t i = 0; i < size; ++i)
            sum[i] += factor * (values[i] * column[i]);
        sum += size;
        values += size;
    }
}

void multiple_angles(float* result, float cosine, std::size_t count)
{
    result[0] = 1.0f;
    result[1] = cosine;
    // cos((a + b) x) = 2 cos(a x) cos(b x) - cos((a - b) x), with a - b = 0 or 1.
    for (std::size_t m = 2; m < count; ++m)
        result[m] = 2.0f * result[m / 2] * result[(m + 1) / 2] - result[m % 2];
}

BEAMSPREAD_CLONES void multiply(float* __restrict product, const float* a, const float* b, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        product[i] = a[i] * b[i];
}

BEAMSPREAD_CLONES void add_product(Complex* sum, const float* factor, const Complex* values, std::size_t count)
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

BEAMSPREAD_CLONES void turn(float* __restrict cosine, float* __restrict sine, const float* cos_beta,
                            const float* sin_beta, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const float next = cosine[i] * cos_beta[i] - sine[i] * sin_beta[i];
        sine[i] = sine[i] * cos_beta[i] + cosine[i] * sin_beta[i];
        cosine[i] = next;
    }
}

BEAMSPREAD_CLONES void find_angles(const float* directions, const float* irradiance, float* __restrict cos_beta,
                                   float* __restrict sin_beta, float* __restrict half_tangent, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const bool lit = irradiance[i] != 0.0f;
        const float dx = directions[3 * i];
        const float dy = directions[3 * i + 1];
        const float dz = directions[3 * i + 2];
        const float x = lit ? dx : 0.0f;
        const float y = lit ? dy : 0.0f;
        const float z = lit ? dz : -1.0f;
        const float across = std::sqrt(x * x + y * y);
        const float length = std::sqrt(x * x + y * y + z * z);
        const bool slants = across > 0.0f;
        const float per_across = 1.0f / (slants ? across : 1.0f);
        cos_beta[i] = slants ? x * per_across : 1.0f;
        sin_beta[i] = y * per_across;
        half_tangent[i] = across / (length - z);
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
