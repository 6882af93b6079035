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

[[gnu::always_inline]] inline void load(const float* values, std::array<Texels, vectors>& texels)
{
    std::memcpy(texels.data(), values, sizeof(texels));
}

void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const float* light,
                       const float* entering, const float* albedo, float* textured, float* plain)
{
    std::array<Texels, vectors> sum, plain_sum;
    load(textured, sum);
    load(plain, plain_sum);
    for (std::size_t p = 0; p < count; ++p) {
        const std::ptrdiff_t* place = paths.places.data() + paths.first[p];
        const std::ptrdiff_t* const end = paths.places.data() + paths.first[p + 1];
        std::array<Texels, vectors> product, factor;
        load(light + *place, product);
        for (std::size_t v = 0; v < vectors; ++v)
            product[v] *= scale;
        load(entering + *place, factor);
        for (std::size_t v = 0; v < vectors; ++v)
            plain_sum[v] += paths.weight[p] * (product[v] * factor[v]);
        while (++place < end) {
            load(albedo + *place, factor);
            for (std::size_t v = 0; v < vectors; ++v)
                product[v] *= factor[v];
        }
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
