// Compiled for each target of Highway like simd/loops.cpp: plain code of vectors, without contraction, gives the same
// bits on all targets.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "solve/surface/pair_sum.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "simd/wide-inl.h"
#include "solve/surface/pair_sum.h"
#include "solve/surface/pairs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

using Lanes = Wide<lanes_per_block>;
using Harmonics8 = float __attribute__((vector_size(surface_harmonics * sizeof(float))));
using Indices8 = std::int32_t __attribute__((vector_size(surface_harmonics * sizeof(std::int32_t))));
static_assert(lanes_per_block == 2 * surface_harmonics);

// Real and imaginary part of the powers m below 2^count of x + i y; count is at most 3.
[[gnu::always_inline]] inline void powers(float x, float y, std::size_t count, Harmonics8& real, Harmonics8& imaginary)
{
    constexpr std::array<Harmonics8, 3> bits = {Harmonics8{0, 1, 0, 1, 0, 1, 0, 1}, Harmonics8{0, 0, 1, 1, 0, 0, 1, 1},
                                                Harmonics8{0, 0, 0, 0, 1, 1, 1, 1}};
    real = Harmonics8{} + 1.0f;
    imaginary = Harmonics8{};
    for (std::size_t i = 0; i < count; ++i) {
        const Harmonics8 by_x = 1.0f + bits[i] * (x - 1.0f);
        const Harmonics8 by_y = bits[i] * y;
        const Harmonics8 next = real * by_x - imaginary * by_y;
        imaginary = imaginary * by_x + real * by_y;
        real = next;
        const float twice = 2.0f * x * y;
        x = x * x - y * y;
        y = twice;
    }
}

// The values of each lane's harmonic.
template <class Vector>
[[gnu::always_inline]] inline void spread(const Harmonics8& values, const std::int32_t* harmonic, Vector& lanes)
{
#if defined(__clang__)
    std::array<float, lanes_per_block> chosen;
    for (std::size_t i = 0; i < lanes_per_block; ++i)
        chosen[i] = values[harmonic[i]];
    lanes.load(chosen.data());
#else
    // One copy of each half: GCC would copy both by parts, for which the loads of halves would wait.
    Indices8 first;
    Indices8 second;
    std::memcpy(&first, harmonic, sizeof(first));
    std::memcpy(&second, harmonic + surface_harmonics, sizeof(second));
    const Harmonics8 low = __builtin_shuffle(values, first);
    const Harmonics8 high = __builtin_shuffle(values, second);
    if constexpr (Vector::part_count == 1) {
        lanes.parts = {__builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)};
    } else if constexpr (Vector::part_count == 2) {
        lanes.parts = {low, high};
    } else {
        lanes.parts = {__builtin_shufflevector(low, low, 0, 1, 2, 3), __builtin_shufflevector(low, low, 4, 5, 6, 7),
                       __builtin_shufflevector(high, high, 0, 1, 2, 3),
                       __builtin_shufflevector(high, high, 4, 5, 6, 7)};
    }
#endif
}

// Old processors have one function for any number of results: less code.
constexpr bool is_plain = HWY_TARGET == HWY_SCALAR;

using BlockCounts = std::array<std::uint8_t, max_results>;

[[gnu::always_inline]] inline bool has_disk(const Pairs& pairs, std::size_t count)
{
    std::int32_t any = 0;
    for (std::size_t i = 0; i < count; ++i)
        any |= pairs.is_disk[i];
    return any != 0;
}

[[gnu::always_inline]] inline std::size_t least_step(const Pairs& pairs, std::size_t count)
{
    std::int32_t least = pairs.step[0];
    for (std::size_t i = 1; i < count; ++i)
        least = std::min(least, pairs.step[i]);
    return static_cast<std::size_t>(least);
}

// Sums of the targets, by the lanes of groups, and that of pairs that bend more than the tables.
template <std::size_t most_groups>
struct LaneSums {
    std::array<std::array<Lanes, most_groups>, PairTargets::most> all{};
    std::array<Lanes, PairTargets::most> beyond{};
};

// Adds the light of a source. `target` has positions, then normals. `is_one_block`: all functions fit into one block.
template <std::size_t most_groups, bool is_one_block, class Source>
[[gnu::always_inline]] inline void add_source(const PairTables& tables, const PairTargets& targets,
                                              const std::array<Floats, 6>& target, const Source& source,
                                              const float* moments, std::size_t stride, LaneSums<most_groups>& sums)
{
    constexpr bool is_cluster = std::is_same_v<Source, ClusterSource>;
    const std::size_t groups = is_plain ? tables.lanes.groups : most_groups;
    const std::size_t lanes = is_one_block ? lanes_per_block : tables.lanes.lanes();
    const BlockCounts* point_blocks = tables.point->blocks.data();
    BlockCounts all_blocks;
    all_blocks.fill(static_cast<std::uint8_t>(tables.lanes.blocks));
    Pairs pairs;
    std::array<Rows, most_groups> rows;
    if (!find_pairs(tables, target, source, pairs))
        return;
    const Integers is_beyond = (pairs.curvature < tables.least_curvature) | (pairs.curvature > tables.most_curvature);
    const BlockCounts most =
        is_cluster || !has_disk(pairs, targets.count) ? point_blocks[least_step(pairs, targets.count)] : all_blocks;
    for (std::size_t g = 0; g < groups; ++g)
        if (most[g] > 0)
            find_rows(tables, source, pairs, tables.scales[g], is_cluster, rows[g]);
    const float* of_source = moments + source.moments * stride;
    const std::size_t bits = tables.lanes.harmonic_bits;
    const Floats weights = source.area * pairs.per_square;
    // Moments with cos and sin(m beta).
    std::array<Lanes, 2> light_of_block;
    const auto load_light = [&](std::size_t g, std::size_t b) __attribute__((always_inline)) {
        const float* values = of_source + (tables.lanes.set[g] * tables.lanes.blocks + b) * 2 * lanes_per_block;
        light_of_block[0].load(values);
        light_of_block[1].load(values + lanes_per_block);
    };
    Lanes is_first;  // 1 where m is 1, else 0
    if constexpr (is_one_block) {
        load_light(0, 0);
        is_first.load(tables.lanes.is_first.data());
    }
    for (std::size_t i = 0; i < targets.count; ++i) {
        if (!(pairs.chord[i] < tables.reach) || (!is_cluster && source.moments == targets.own[i]))
            continue;
        const bool is_disk = !is_cluster && pairs.is_disk[i] != 0;
        const BlockCounts& counts = is_disk ? all_blocks : point_blocks[static_cast<std::size_t>(pairs.step[i])];
        bool at_node = true;
        std::size_t blocks = 0;
        for (std::size_t g = 0; g < groups; ++g) {
            at_node = at_node && (counts[g] == 0 || rows[g].to_high[i] == 0);
            blocks = std::max<std::size_t>(blocks, counts[g]);
        }
        if (blocks == 0)
            continue;
        const ChordTable& table = is_disk ? tables.disks[source.disk]->light : tables.point->light;
        const float weight = weights[i];
        Harmonics8 real{};
        Harmonics8 imaginary{};
        if (bits > 1) {
            powers(pairs.cosine[i], pairs.sine[i], bits, real, imaginary);
            real *= weight;
            imaginary *= weight;
        }
        // Value at the place of the rows of a group.
        const auto interpolate = [&](std::size_t g, const float* values, Lanes& value) __attribute__((always_inline)) {
            const float* first = values + rows[g].first[i];
            std::array<Lanes, 2> row;
            row[0].load(first);
            row[1].load(first + lanes);
            value = row[0] * rows[g].weight[0][i] + row[1] * rows[g].weight[1][i];
            if (at_node)
                return;
            const float* high = first + rows[g].to_high[i];
            row[0].load(high);
            row[1].load(high + lanes);
            value += row[0] * rows[g].weight[2][i] + row[1] * rows[g].weight[3][i];
        };
        for (std::size_t b = 0; b < (is_one_block ? 1 : blocks); ++b) {
            const std::size_t at = b * lanes_per_block;
            Lanes cosines, sines;
            if (bits > 1) {
                spread(real, tables.lanes.harmonic.data() + at, cosines);
                spread(imaginary, tables.lanes.harmonic.data() + at, sines);
            } else {
                if constexpr (!is_one_block)
                    is_first.load(tables.lanes.is_first.data() + at);
                cosines = weight + is_first * (weight * (pairs.cosine[i] - 1.0f));
                sines = is_first * (weight * pairs.sine[i]);
            }
            Lanes light{};
            Lanes turned{};
            std::size_t set = max_results;
            for (std::size_t g = 0; g < groups; ++g) {
                if (b >= counts[g])
                    continue;
                if (is_one_block || tables.lanes.set[g] != set) {
                    set = tables.lanes.set[g];
                    if constexpr (!is_one_block)
                        load_light(g, b);
                    light = light_of_block[0] * cosines + light_of_block[1] * sines;
                    if constexpr (is_cluster)
                        turned = light_of_block[1] * cosines - light_of_block[0] * sines;
                }
                Lanes value;
                interpolate(g, table.values[g].data() + at, value);
                Lanes product = light * value;
                // The functions of other blocks are small.
                if constexpr (is_cluster) {
                    if (b == 0) {
                        Lanes second;
                        const std::size_t nearest = rows[g].nearest[i] + at;
                        second.load(tables.point->laplacian.values[g].data() + nearest);
                        value += second * (source.spread * pairs.per_square[i]);
                        second.load(tables.point->along.values[g].data() + nearest);
                        value += second * pairs.along[i];
                        second.load(tables.point->across.values[g].data() + nearest);
                        product = light * value + turned * (second * pairs.across[i]);
                    }
                }
                sums.all[i][g] += product;
                if (g == 0 && is_beyond[i] != 0)
                    sums.beyond[i] += product;
            }
        }
    }
}

template <std::size_t most_groups, bool is_one_block>
void add_pairs_of(const PairTables& tables, const PairTargets& targets, const PairSources& sources,
                  const float* moments, std::size_t stride, float* sums, float* beyond)
{
    std::array<Floats, 6> target;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        load_targets(targets.position[axis], target[axis]);
        load_targets(targets.normal[axis], target[3 + axis]);
    }
    LaneSums<most_groups> all;
    for (const std::span<const PairSource> samples : sources.samples)
        for (const PairSource& sample : samples)
            add_source<most_groups, is_one_block>(tables, targets, target, sample, moments, stride, all);
    for (const ClusterSource* cluster : sources.clusters)
        add_source<most_groups, is_one_block>(tables, targets, target, *cluster, moments, stride, all);
    std::array<float, lanes_per_block> values;
    for (std::size_t i = 0; i < targets.count; ++i) {
        for (std::size_t g = 0; g < tables.lanes.groups; ++g) {
            all.all[i][g].store(values.data());
            tables.lanes.add(g, values.data(), sums + i * max_results);
        }
        std::array<float, max_results> of_results{};
        all.beyond[i].store(values.data());
        tables.lanes.add(0, values.data(), of_results.data());
        beyond[i] += of_results[0];
    }
}

void add_pairs(const PairTables& tables, const PairTargets& targets, const PairSources& sources, const float* moments,
               std::size_t stride, float* sums, float* beyond)
{
    static_assert(max_results == 3);
    const bool is_one_block = tables.lanes.groups == 1 && tables.lanes.blocks == 1;
    const auto add = is_plain || tables.lanes.groups == 3 ? add_pairs_of<3, false>
                     : tables.lanes.groups == 2           ? add_pairs_of<2, false>
                     : is_one_block                       ? add_pairs_of<1, true>
                                                          : add_pairs_of<1, false>;
    add(tables, targets, sources, moments, stride, sums, beyond);
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

HWY_EXPORT(add_pairs);
void add_pairs(const PairTables& tables, const PairTargets& targets, const PairSources& sources, const float* moments,
               std::size_t stride, float* sums, float* beyond)
{
    HWY_DYNAMIC_DISPATCH(add_pairs)(tables, targets, sources, moments, stride, sums, beyond);
}

}  // namespace beamspread
#endif
