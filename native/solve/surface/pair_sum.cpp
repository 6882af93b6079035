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

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

using Lanes = Wide<lanes_per_block>;
using Harmonics8 = float __attribute__((vector_size(surface_harmonics * sizeof(float))));
using Indices8 = std::int32_t __attribute__((vector_size(surface_harmonics * sizeof(std::int32_t))));
static_assert(lanes_per_block == 2 * surface_harmonics);

// Length of a chord in the tangent plane, over the chord, below which harmonics fade. Larger: smoother where light
// crosses edges, less exact around balls.
constexpr float steep = 0.5f;

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

// Distance of a curvature from a node, over that of two nodes, below which it counts as at the node: on planes rounding
// alone moves it. Larger: less time where a surface hardly bends, larger errors.
constexpr float least_part = 1e-4f;

// Sums of the sines of slopes from which on a pair counts as one across an edge, partly and wholly. Smaller: facets of
// smooth meshes count; larger: edges are too bright.
constexpr float edge_begin = 0.25f;
constexpr float edge_end = 0.75f;

// The same for chords from which on light diffuses, in transport mean free paths of the first result. Smaller: dark media
// lose light at edges; larger: bright edges are too bright.
constexpr float diffuse_begin = 3.0f;
constexpr float diffuse_end = 6.0f;

// Old processors have one function for any number of results: less code.
constexpr bool is_plain = HWY_TARGET == HWY_SCALAR;

// A value of each target.
using Floats = float __attribute__((vector_size(PairTargets::most * sizeof(float))));
using Integers = std::int32_t __attribute__((vector_size(PairTargets::most * sizeof(std::int32_t))));

[[gnu::always_inline]] inline void load_targets(const std::array<float, PairTargets::most>& from, Floats& to)
{
    std::memcpy(&to, from.data(), sizeof(to));
}

[[gnu::always_inline]] inline void find_roots(Floats& values)
{
    std::array<float, PairTargets::most> roots;
    std::memcpy(roots.data(), &values, sizeof(values));
    for (float& root : roots)
        root = std::sqrt(root);
    std::memcpy(&values, roots.data(), sizeof(values));
}

[[gnu::always_inline]] inline void clamp_part(Floats& part)
{
    const Floats zero{};
    const Floats one = zero + 1.0f;
    part = part < zero ? zero : part > one ? one : part;
}

// Pairs of one source and all targets.
struct Pairs {
    Floats chord;
    Integers is_disk;
    Integers step;      // of the chord, after the first row
    Floats part;        // of the way from its first chord to the next
    Floats per_square;  // 1 / chord^2
    Floats curvature;
    Floats cosine;  // of the chord's azimuth in the tangent plane of the source, times the fade
    Floats sine;
    Floats along;  // half of a cluster's squares over chord^2: those along the chord less a half of all
    Floats across;  // and those of the chord and a line across it, negative
};

// Rows of a group's table around a chord and a curvature, and their weights, for each target.
struct Rows {
    std::array<std::uint32_t, PairTargets::most> first;    // the value of the lower chord and curvature
    std::array<std::uint32_t, PairTargets::most> to_high;  // to that of the next curvature
    std::array<Floats, 4> weight;                          // 0 for the next curvature at a node
    std::array<std::uint32_t, PairTargets::most> nearest;  // for derivatives, which are smooth and small
};

// Chord times the sum of the sines of a pair's slopes: the angles between the chord and the tangent planes at its ends, which
// are equal on balls. Where they differ at a sharp edge, twice their geometric mean takes the place of their sum: far from
// where light enters, it diffuses in proportion to their product (n_x . grad)(n_y . grad) 1/r.
[[gnu::always_inline]] inline void find_bend(const PairTables& tables, const Floats& entering, const Floats& leaving,
                                             const Floats& chord, Floats& bend)
{
    const Floats zero{};
    const Floats sum = entering + leaving;
    const Floats size = sum < zero ? zero - sum : sum;
    Floats mean = entering * leaving;
    mean = mean < zero ? zero : mean;
    find_roots(mean);
    mean = sum < zero ? -2.0f * mean : 2.0f * mean;
    const Floats least = zero + std::numeric_limits<float>::min();
    Floats is_edge = (size / (chord < least ? least : chord) - edge_begin) / (edge_end - edge_begin);
    clamp_part(is_edge);
    Floats is_diffuse = (chord * tables.most_curvature - diffuse_begin) / (diffuse_end - diffuse_begin);
    clamp_part(is_diffuse);
    bend = sum + is_edge * is_diffuse * (mean - sum);
}

// False if the source is beyond reach of all targets. `target` has positions, then normals.
template <class Source>
[[gnu::always_inline]] inline bool find_pairs(const PairTables& tables, const std::array<Floats, 6>& target,
                                              const Source& source, Pairs& pairs)
{
    constexpr bool is_cluster = std::is_same_v<Source, ClusterSource>;
    const Floats dx = target[0] - source.position.x;
    const Floats dy = target[1] - source.position.y;
    const Floats dz = target[2] - source.position.z;
    Floats chord = dx * dx + dy * dy + dz * dz;
    find_roots(chord);
    pairs.chord = chord;
    const Integers is_reached = chord < tables.reach;
    std::int32_t any_reached = 0;
    for (std::size_t i = 0; i < PairTargets::most; ++i)
        any_reached |= is_reached[i];
    if (any_reached == 0)
        return false;
    const ChordTable& point = tables.point->light;
    Integers first = Integers{} + static_cast<std::int32_t>(point.first);
    Integers last = first + static_cast<std::int32_t>(point.rows - 2);
    pairs.is_disk = Integers{};
    if constexpr (!is_cluster) {
        const DiskTable& disk = *tables.disks[source.disk];
        pairs.is_disk = chord < disk.end;
        chord = (pairs.is_disk & (chord < disk.begin)) ? Floats{} + disk.begin : chord;
        const auto disk_first = static_cast<std::int32_t>(disk.light.first);
        const auto disk_last = disk_first + static_cast<std::int32_t>(disk.light.rows - 2);
        first = pairs.is_disk ? Integers{} + disk_first : first;
        last = pairs.is_disk ? Integers{} + disk_last : last;
    }
    Integers step = reinterpret_cast<Integers>(chord) >> within_chord_bits;
    step = step < first ? first : step > last ? last : step;
    const Floats before = reinterpret_cast<Floats>(step << within_chord_bits);
    const Floats after = reinterpret_cast<Floats>((step + 1) << within_chord_bits);
    const Floats zero{};
    const Floats one = zero + 1.0f;
    pairs.part = (chord - before) / (after - before);
    clamp_part(pairs.part);
    pairs.step = step - first;
    const Floats least = chord < before ? before : chord;
    const Floats square = least * least;
    pairs.per_square = one / square;
    const Floats leaving = target[3] * dx + target[4] * dy + target[5] * dz;
    Floats entering = zero - (source.normal.x * dx + source.normal.y * dy + source.normal.z * dz);
    if constexpr (is_cluster)
        entering += source.bend;
    find_bend(tables, entering, leaving, chord, pairs.curvature);
    if constexpr (is_cluster)
        pairs.curvature = pairs.curvature / (square + 4.0f * source.spread);
    else
        pairs.curvature *= pairs.per_square;
    const Floats x = dx * source.tangent.x + dy * source.tangent.y + dz * source.tangent.z;
    const Floats y = dx * source.binormal.x + dy * source.binormal.y + dz * source.binormal.z;
    Floats across = x * x + y * y;
    find_roots(across);
    // On planes and balls |D_t| / c = sqrt(1 - (k c / 2)^2). Where a chord is steeper than any but the longest of a
    // ball, the azimuth changes abruptly from point to point; there harmonics fade, as they do opposite the entry.
    const Floats fade = chord * steep;
    across = across < fade ? fade : across;
    const Floats least_across = zero + std::numeric_limits<float>::min();
    const Floats per_across = one / (across < least_across ? least_across : across);
    pairs.cosine = x * per_across;
    pairs.sine = y * per_across;
    if constexpr (is_cluster) {
        const auto& [xx, yy, zz, xy, yz, zx] = source.squares;
        const Floats by_x = xx * dx + xy * dy + zx * dz;
        const Floats by_y = xy * dx + yy * dy + yz * dz;
        const Floats by_z = zx * dx + yz * dy + zz * dz;
        const Floats half_fourth = 0.5f * pairs.per_square * pairs.per_square;
        pairs.along = (by_x * dx + by_y * dy + by_z * dz - 2.0f * source.spread * square) * half_fourth;
        const Floats to_x = pairs.sine * source.tangent.x - pairs.cosine * source.binormal.x;
        const Floats to_y = pairs.sine * source.tangent.y - pairs.cosine * source.binormal.y;
        const Floats to_z = pairs.sine * source.tangent.z - pairs.cosine * source.binormal.z;
        pairs.across = (by_x * to_x + by_y * to_y + by_z * to_z) * chord * half_fourth;
    }
    return true;
}

// Index of the node before each curvature, and the part of the way to the next.
[[gnu::always_inline]] inline void find_nodes(const CurvatureScale& scale, const Floats& curvature, Integers& node,
                                              Floats& part)
{
    node = Integers{};
    part = Floats{};
    if (scale.per_step == 0.0f)
        return;
    // Most pairs bend little.
    std::int32_t all_between = scale.middle > 0 ? -1 : 0;
    if (scale.middle > 0) {
        const Integers is_between =
            (curvature >= scale.nodes[scale.middle - 1]) & (curvature < scale.nodes[scale.middle + 1]);
        for (std::size_t i = 0; i < PairTargets::most; ++i)
            all_between &= is_between[i];
    }
    if (all_between != 0) {
        const Integers is_above = curvature >= scale.nodes[scale.middle];
        node = static_cast<std::int32_t>(scale.middle - 1) - is_above;
        part = is_above ? (curvature - scale.nodes[scale.middle]) * scale.per_width[scale.middle]
                        : (curvature - scale.nodes[scale.middle - 1]) * scale.per_width[scale.middle - 1];
    } else {
        std::array<float, PairTargets::most> parts;
        std::array<std::int32_t, PairTargets::most> nodes;
        for (std::size_t i = 0; i < PairTargets::most; ++i) {
            const std::size_t k = scale.interval_of(curvature[i]);
            nodes[i] = static_cast<std::int32_t>(k);
            parts[i] = (curvature[i] - scale.nodes[k]) * scale.per_width[k];
        }
        load_targets(parts, part);
        std::memcpy(&node, nodes.data(), sizeof(node));
    }
    const Floats zero{};
    const Integers is_next = (part > 1.0f - least_part) & (part < 1.0f + least_part);
    node -= is_next;
    part = is_next | ((part > -least_part) & (part < least_part)) ? zero : part;
}

[[gnu::always_inline]] inline void find_rows(const PairTables& tables, const PairSource& source, const Pairs& pairs,
                                             const CurvatureScale& scale, bool is_cluster, Rows& rows)
{
    const Floats low = Floats{} + scale.nodes.front();
    const Floats high = Floats{} + scale.nodes.back();
    const Floats& curvature = pairs.curvature;
    Integers node;
    Floats to_next;
    find_nodes(scale, curvature < low ? low : curvature > high ? high : curvature, node, to_next);
    const auto lanes = static_cast<std::int32_t>(tables.lanes.lanes());
    const Integers point_rows = Integers{} + static_cast<std::int32_t>(tables.point->light.rows);
    Integers count = point_rows;
    if (!is_cluster)
        count = pairs.is_disk ? Integers{} + static_cast<std::int32_t>(tables.disks[source.disk]->light.rows) : count;
    const Integers first = (node * count + pairs.step) * lanes;
    const Integers to_high = to_next != 0.0f ? count * lanes : Integers{};
    std::memcpy(rows.first.data(), &first, sizeof(first));
    std::memcpy(rows.to_high.data(), &to_high, sizeof(to_high));
    if (is_cluster) {
        const Integers nearest = first + ((pairs.part > 0.5f) & (Integers{} + lanes)) + ((to_next > 0.5f) & to_high);
        std::memcpy(rows.nearest.data(), &nearest, sizeof(nearest));
    }
    rows.weight = {(1.0f - to_next) * (1.0f - pairs.part), (1.0f - to_next) * pairs.part, to_next * (1.0f - pairs.part),
                   to_next * pairs.part};
}

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
