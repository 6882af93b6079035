// Compiled for each target of Highway like simd/loops.cpp: plain code of vectors, without contraction, gives the same
// bits on all targets.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solve/surface/pair_sum.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "solve/surface/pair_sum.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

using Lanes = float __attribute__((vector_size(lanes_per_block * sizeof(float))));
using Half = float __attribute__((vector_size(lanes_per_block * sizeof(float) / 2)));

constexpr std::size_t max_results = 3;

[[gnu::always_inline]] inline Lanes load(const float* values)
{
    Lanes lanes;
    std::memcpy(&lanes, values, sizeof(lanes));
    return lanes;
}

[[gnu::always_inline]] inline float sum_of(const Lanes& lanes)
{
    std::array<float, lanes_per_block> values;
    std::memcpy(values.data(), &lanes, sizeof(lanes));
    for (std::size_t width = lanes_per_block / 2; width > 0; width /= 2)
        for (std::size_t i = 0; i < width; ++i)
            values[i] += values[i + width];
    return values[0];
}

// cos and sin of m phi for the harmonics of each lane, m below 8 twice.
[[gnu::always_inline]] inline void multiple_angles(float cosine, float sine, Lanes& cosines, Lanes& sines)
{
    constexpr std::array<Half, 3> bits = {Half{0, 1, 0, 1, 0, 1, 0, 1}, Half{0, 0, 1, 1, 0, 0, 1, 1},
                                          Half{0, 0, 0, 0, 1, 1, 1, 1}};
    Half cos_m = Half{} + 1.0f;
    Half sin_m{};
    for (const Half& bit : bits) {
        const Half by_cos = 1.0f + bit * (cosine - 1.0f);
        const Half by_sin = bit * sine;
        const Half next = cos_m * by_cos - sin_m * by_sin;
        sin_m = sin_m * by_cos + cos_m * by_sin;
        cos_m = next;
        const float twice = 2.0f * cosine * sine;
        cosine = cosine * cosine - sine * sine;
        sine = twice;
    }
    cosines = __builtin_shufflevector(cos_m, cos_m, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    sines = __builtin_shufflevector(sin_m, sin_m, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

// Rows of a table around a chord and a curvature, and their weights.
struct Rows {
    std::size_t first;  // index of the value of the lower chord and curvature
    std::size_t to_next;  // to that of the next chord
    std::size_t to_high;  // to that of the next curvature
    std::array<float, 4> weight;
};

template <std::size_t results, bool are_clusters>
void add_pairs_of(const PairTables& tables, const PairTarget& target, std::span<const PairSource> sources,
                  const float* moments, std::size_t stride, float* sums, float& beyond)
{
    // Value at the place of some rows in a table.
    const auto interpolated = [](const Rows& rows, const float* values) __attribute__((always_inline)) {
        const float* first = values + rows.first;
        const float* high = first + rows.to_high;
        return (load(first) * rows.weight[0] + load(first + rows.to_next) * rows.weight[1]) +
               (load(high) * rows.weight[2] + load(high + rows.to_next) * rows.weight[3]);
    };
    std::array<Lanes, results> all{};
    Lanes clamped{};
    const std::size_t blocks = tables.blocks;
    const std::size_t lanes = blocks * lanes_per_block;
    for (const PairSource& source : sources) {
        const Vec3f d = target.position - source.position;
        const float square = d.x * d.x + d.y * d.y + d.z * d.z;
        const float chord = std::sqrt(square);
        if (chord >= tables.reach)
            continue;
        const bool is_disk = !are_clusters && chord < tables.disk_end[source.disk];
        const ChordTable& table = is_disk ? tables.disks[source.disk] : tables.point;
        const std::uint32_t step = std::clamp(chord_step(chord), table.first, table.first + table.rows - 2);
        const float before = chord_of(step);
        const float part = std::clamp((chord - before) / (chord_of(step + 1) - before), 0.0f, 1.0f);
        const float per_square = 1.0f / std::max(square, before * before);
        const float curvature = ((target.normal.x - source.normal.x) * d.x + (target.normal.y - source.normal.y) * d.y +
                                 (target.normal.z - source.normal.z) * d.z) *
                                per_square;
        std::array<Rows, results> rows;
        bool is_beyond = false;
        for (std::size_t r = 0; r < results; ++r) {
            const CurvatureScale& scale = tables.scales[r];
            const float inside = std::clamp(curvature, scale.nodes.front(), scale.nodes.back());
            const std::size_t k = scale.per_step > 0.0f ? scale.interval_of(inside) : 0;
            const std::size_t next = scale.per_step > 0.0f ? k + 1 : 0;
            const float to_next =
                scale.per_step > 0.0f ? (inside - scale.nodes[k]) / (scale.nodes[k + 1] - scale.nodes[k]) : 0.0f;
            if (r == 0)
                is_beyond = inside != curvature;
            const std::size_t row = k * table.rows + step - table.first;
            rows[r] = {
                row * lanes,
                lanes,
                (next - k) * table.rows * lanes,
                {(1.0f - to_next) * (1.0f - part), (1.0f - to_next) * part, to_next * (1.0f - part), to_next * part}};
        }
        // The chord's azimuth in the tangent plane of the source.
        const float x = d.x * source.tangent.x + d.y * source.tangent.y + d.z * source.tangent.z;
        const float y = d.x * source.binormal.x + d.y * source.binormal.y + d.z * source.binormal.z;
        const float across = x * x + y * y;
        const float per_across = across > 0.0f ? 1.0f / std::sqrt(across) : 0.0f;
        Lanes cosines, sines;
        multiple_angles(x * per_across, y * per_across, cosines, sines);
        const float* of_source = moments + source.moments * stride;
        const Lanes weight = Lanes{} + source.area * per_square;
        cosines *= weight;
        sines *= weight;
        for (std::size_t b = 0; b < blocks; ++b) {
            Lanes light{};
            for (std::size_t r = 0; r < results; ++r) {
                if (r == 0 || tables.set[r] != tables.set[r - 1]) {
                    const float* values = of_source + (tables.set[r] * blocks + b) * 2 * lanes_per_block;
                    light = load(values) * cosines + load(values + lanes_per_block) * sines;
                }
                const std::size_t at = b * lanes_per_block;
                Lanes value = interpolated(rows[r], table.values[r].data() + at);
                if constexpr (are_clusters)
                    value +=
                        interpolated(rows[r], tables.laplacian.values[r].data() + at) * (source.spread * per_square);
                const Lanes product = light * value;
                all[r] += product;
                if (r == 0 && is_beyond)
                    clamped += product;
            }
        }
    }
    for (std::size_t r = 0; r < results; ++r)
        sums[r] += sum_of(all[r]);
    beyond += sum_of(clamped);
}

template <bool are_clusters>
void add_pairs_of_kind(const PairTables& tables, const PairTarget& target, std::span<const PairSource> sources,
                       const float* moments, std::size_t stride, float* sums, float& beyond)
{
    static_assert(max_results == 3);
    if (tables.results == 1)
        add_pairs_of<1, are_clusters>(tables, target, sources, moments, stride, sums, beyond);
    else if (tables.results == 2)
        add_pairs_of<2, are_clusters>(tables, target, sources, moments, stride, sums, beyond);
    else
        add_pairs_of<3, are_clusters>(tables, target, sources, moments, stride, sums, beyond);
}

void add_pairs(const PairTables& tables, const PairTarget& target, std::span<const PairSource> sources,
               bool are_clusters, const float* moments, std::size_t stride, float* sums, float& beyond)
{
    const auto add = are_clusters ? add_pairs_of_kind<true> : add_pairs_of_kind<false>;
    add(tables, target, sources, moments, stride, sums, beyond);
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

HWY_EXPORT(add_pairs);
void add_pairs(const PairTables& tables, const PairTarget& target, std::span<const PairSource> sources,
               bool are_clusters, const float* moments, std::size_t stride, float* sums, float& beyond)
{
    HWY_DYNAMIC_DISPATCH(add_pairs)(tables, target, sources, are_clusters, moments, stride, sums, beyond);
}

}  // namespace beamspread
#endif
