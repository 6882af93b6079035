// Compiled for each target of Highway like simd/loops.cpp: plain code of vectors, without contraction, gives the same
// bits on all targets.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solve/textured/path_products.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <array>
#include <cstring>

#include "solve/textured/path_products.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

constexpr std::size_t lanes = 16;
constexpr std::size_t vectors = texels_per_run / lanes;
using Texels = float __attribute__((vector_size(lanes * sizeof(float))));

[[gnu::always_inline]] inline Texels load(const float* values)
{
    Texels texels;
    std::memcpy(&texels, values, sizeof(texels));
    return texels;
}

void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const float* light,
                       const float* entering, const float* albedo, float* textured, float* plain)
{
    std::array<Texels, vectors> sum, plain_sum;
    for (std::size_t v = 0; v < vectors; ++v) {
        sum[v] = load(textured + v * lanes);
        plain_sum[v] = load(plain + v * lanes);
    }
    const std::ptrdiff_t* const places = paths.places.data();
    for (std::size_t p = 0; p < count; ++p) {
        const std::ptrdiff_t* place = places + paths.first[p];
        const std::ptrdiff_t* const end = places + paths.first[p + 1];
        const float weight = paths.weight[p];
        Texels product[vectors];
#pragma GCC unroll 8
        for (std::size_t v = 0; v < vectors; ++v) {
            product[v] = load(light + *place + v * lanes) * scale;
            plain_sum[v] += weight * (product[v] * load(entering + *place + v * lanes));
        }
        while (++place < end) {
            const float* const at = albedo + *place;
#pragma GCC unroll 8
            for (std::size_t v = 0; v < vectors; ++v)
                product[v] *= load(at + v * lanes);
        }
#pragma GCC unroll 8
        for (std::size_t v = 0; v < vectors; ++v)
            sum[v] += product[v];
    }
    std::memcpy(textured, sum.data(), sizeof(sum));
    std::memcpy(plain, plain_sum.data(), sizeof(plain_sum));
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

HWY_EXPORT(add_path_products);

void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const float* light,
                       const float* entering, const float* albedo, float* textured, float* plain)
{
    HWY_DYNAMIC_DISPATCH(add_path_products)(paths, count, scale, light, entering, albedo, textured, plain);
}

}  // namespace beamspread
#endif
