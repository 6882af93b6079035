// Compiled for each target of Highway like simd/loops.cpp: plain code of vectors, without contraction, gives the same
// bits on all targets.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solve/textured/path_products.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <array>

#include "simd/wide-inl.h"
#include "solve/textured/path_products.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

using Row = Wide<tile_columns>;

// Multiplies by a row of texels.
[[gnu::always_inline]] inline void multiply(Row& product, const float* values)
{
    Row row;
    row.load(values);
    product *= row;
}

void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const TilePlanes& planes,
                       float* textured, float* plain)
{
    std::array<Row, tile_rows> sum, plain_sum;
#pragma GCC unroll 16
    for (std::size_t r = 0; r < tile_rows; ++r) {
        sum[r].load(textured + r * tile_columns);
        plain_sum[r].load(plain + r * tile_columns);
    }
    const std::ptrdiff_t stride = planes.stride;
    for (std::size_t p = 0; p < count; ++p) {
        const std::ptrdiff_t* place = paths.places.data() + paths.first[p];
        const std::ptrdiff_t* const end = paths.places.data() + paths.first[p + 1];
        const float weight = paths.weight[p];
        // Unrolled, since an array that is indexed would be kept in memory.
        std::array<Row, tile_rows> product;
#pragma GCC unroll 16
        for (std::size_t r = 0; r < tile_rows; ++r) {
            const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(r) * stride;
            product[r].load(planes.light + paths.light[p] + row);
            product[r] *= scale;
            if (planes.coverage != nullptr)
                multiply(product[r], planes.coverage + *place + row);
            Row plain_product = product[r];
            multiply(plain_product, planes.entering + *place + row);
            plain_sum[r] += weight * plain_product;
        }
        while (++place < end) {
            const float* const albedo = planes.albedo + *place;
#pragma GCC unroll 16
            for (std::size_t r = 0; r < tile_rows; ++r)
                multiply(product[r], albedo + static_cast<std::ptrdiff_t>(r) * stride);
        }
#pragma GCC unroll 16
        for (std::size_t r = 0; r < tile_rows; ++r)
            sum[r] += product[r];
    }
#pragma GCC unroll 16
    for (std::size_t r = 0; r < tile_rows; ++r) {
        sum[r].store(textured + r * tile_columns);
        plain_sum[r].store(plain + r * tile_columns);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

HWY_EXPORT(add_path_products);

void add_path_products(const PlacedPaths& paths, std::size_t count, float scale, const TilePlanes& planes,
                       float* textured, float* plain)
{
    HWY_DYNAMIC_DISPATCH(add_path_products)(paths, count, scale, planes, textured, plain);
}

}  // namespace beamspread
#endif
