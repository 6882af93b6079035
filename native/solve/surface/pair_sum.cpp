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
#include <limits>

#include "solve/surface/pair_sum.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

using Lanes = float __attribute__((vector_size(lanes_per_block * sizeof(float))));
using Harmonics8 = float __attribute__((vector_size(surface_harmonics * sizeof(float))));
using Indices8 = std::int32_t __attribute__((vector_size(surface_harmonics * sizeof(std::int32_t))));
static_assert(lanes_per_block == 2 * surface_harmonics);

constexpr std::size_t max_results = 3;

// Length of a chord in the tangent plane, over the chord, below which harmonics fade. Larger: smoother where light
// crosses edges, less exact around balls.
constexpr float steep = 0.5f;

[[gnu::always_inline]] inline void load(const float* values, Lanes& lanes)
{
    std::memcpy(&lanes, values, sizeof(lanes));
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

// Real and imaginary part of the powers m below 8 of x + i y.
[[gnu::always_inline]] inline void powers(float x, float y, Harmonics8& real, Harmonics8& imaginary)
{
    constexpr std::array<Harmonics8, 3> bits = {Harmonics8{0, 1, 0, 1, 0, 1, 0, 1}, Harmonics8{0, 0, 1, 1, 0, 0, 1, 1},
                                                Harmonics8{0, 0, 0, 0, 1, 1, 1, 1}};
    real = Harmonics8{} + 1.0f;
    imaginary = Harmonics8{};
    for (const Harmonics8& bit : bits) {
        const Harmonics8 by_x = 1.0f + bit * (x - 1.0f);
        const Harmonics8 by_y = bit * y;
        const Harmonics8 next = real * by_x - imaginary * by_y;
        imaginary = imaginary * by_x + real * by_y;
        real = next;
        const float twice = 2.0f * x * y;
        x = x * x - y * y;
        y = twice;
    }
}

// The values of each lane's harmonic.
[[gnu::always_inline]] inline void spread(const Harmonics8& values, const std::int32_t* harmonic, Lanes& lanes)
{
#if defined(__clang__)
    for (std::size_t i = 0; i < lanes_per_block; ++i)
        lanes[i] = values[harmonic[i]];
#else
    std::array<Indices8, 2> half;
    std::memcpy(half.data(), harmonic, sizeof(half));
    const std::array<Harmonics8, 2> parts = {__builtin_shuffle(values, half[0]), __builtin_shuffle(values, half[1])};
    std::memcpy(&lanes, parts.data(), sizeof(lanes));
#endif
}

// Distance of a curvature from a node, over that of two nodes, below which it counts as at the node: on planes rounding
// alone moves it. Larger: less time where a surface hardly bends, larger errors.
constexpr float least_part = 1e-4f;

// Rows of a table around a chord and a curvature, and their weights.
struct Rows {
    std::size_t first;  // index of the value of the lower chord and curvature
    std::size_t to_next;  // to that of the next chord
    std::size_t to_high;  // to that of the next curvature
    std::array<float, 4> weight;  // 0 for the next curvature at a node
};

template <std::size_t results, bool are_clusters>
void add_pairs_of(const PairTables& tables, const PairTarget& target, std::span<const PairSource> sources,
                  const float* moments, std::size_t stride, float* sums, float& beyond)
{
    // Value at the place of some rows in a table.
    const auto interpolate = [](const Rows& rows, bool at_node, const float* values, Lanes& value)
                                 __attribute__((always_inline)) {
                                     const float* first = values + rows.first;
                                     std::array<Lanes, 2> row;
                                     load(first, row[0]);
                                     load(first + rows.to_next, row[1]);
                                     value = row[0] * rows.weight[0] + row[1] * rows.weight[1];
                                     if (at_node)
                                         return;
                                     const float* high = first + rows.to_high;
                                     load(high, row[0]);
                                     load(high + rows.to_next, row[1]);
                                     value = value + (row[0] * rows.weight[2] + row[1] * rows.weight[3]);
                                 };
    std::array<Lanes, results> all{};
    Lanes clamped{};
    const std::size_t lanes = tables.blocks * lanes_per_block;
    for (const PairSource& source : sources) {
        const Vec3f d = target.position - source.position;
        const float square = d.x * d.x + d.y * d.y + d.z * d.z;
        float chord = std::sqrt(square);
        if (chord >= tables.reach)
            continue;
        const bool is_disk = !are_clusters && chord < tables.disks[source.disk]->end;
        if (is_disk)
            chord = std::max(chord, tables.disks[source.disk]->begin);
        const ChordTable& table = is_disk ? tables.disks[source.disk]->light : tables.point->light;
        const std::uint32_t step = std::clamp(chord_step(chord), table.first, table.first + table.rows - 2);
        const float before = chord_of(step);
        const float part = std::clamp((chord - before) / (chord_of(step + 1) - before), 0.0f, 1.0f);
        const float per_square = 1.0f / std::max(chord * chord, before * before);
        const float curvature = ((target.normal.x - source.normal.x) * d.x + (target.normal.y - source.normal.y) * d.y +
                                 (target.normal.z - source.normal.z) * d.z) *
                                per_square;
        std::array<Rows, results> rows;
        bool is_beyond = false;
        bool at_node = true;
        for (std::size_t r = 0; r < results; ++r) {
            const CurvatureScale& scale = tables.scales[r];
            const float inside = std::clamp(curvature, scale.nodes.front(), scale.nodes.back());
            std::size_t k = scale.per_step > 0.0f ? scale.interval_of(inside) : 0;
            float to_next =
                scale.per_step > 0.0f ? (inside - scale.nodes[k]) / (scale.nodes[k + 1] - scale.nodes[k]) : 0.0f;
            if (std::abs(to_next - 1.0f) < least_part) {
                ++k;
                to_next = 0.0f;
            } else if (std::abs(to_next) < least_part) {
                to_next = 0.0f;
            }
            at_node = at_node && to_next == 0.0f;
            const std::size_t next = to_next != 0.0f ? k + 1 : k;
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
        const float across = std::sqrt(x * x + y * y);
        // On planes and balls |D_t| / c = sqrt(1 - (k c / 2)^2). Where a chord is steeper than any but the longest of a
        // ball, the azimuth changes abruptly from point to point; there harmonics fade, as they do opposite the entry.
        const float per_across = 1.0f / std::max({across, steep * chord, std::numeric_limits<float>::min()});
        Harmonics8 real, imaginary;
        powers(x * per_across, y * per_across, real, imaginary);
        const float* of_source = moments + source.moments * stride;
        const float weight = source.area * per_square;
        real *= weight;
        imaginary *= weight;
        const std::size_t blocks = is_disk ? tables.blocks : tables.point->blocks[step - table.first];
        for (std::size_t b = 0; b < blocks; ++b) {
            Lanes cosines, sines;
            spread(real, tables.harmonic.data() + b * lanes_per_block, cosines);
            spread(imaginary, tables.harmonic.data() + b * lanes_per_block, sines);
            Lanes light{};
            for (std::size_t r = 0; r < results; ++r) {
                if (r == 0 || tables.set[r] != tables.set[r - 1]) {
                    const float* values = of_source + (tables.set[r] * tables.blocks + b) * 2 * lanes_per_block;
                    std::array<Lanes, 2> pair;
                    load(values, pair[0]);
                    load(values + lanes_per_block, pair[1]);
                    light = pair[0] * cosines + pair[1] * sines;
                }
                const std::size_t at = b * lanes_per_block;
                Lanes value;
                interpolate(rows[r], at_node, table.values[r].data() + at, value);
                if constexpr (are_clusters) {
                    Lanes second;
                    interpolate(rows[r], at_node, tables.point->laplacian.values[r].data() + at, second);
                    value += second * (source.spread * per_square);
                }
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
