// Chords, curvatures and azimuths of pairs of samples, and the rows of tables around them. Compiled once per target, hence
// the toggled include guard (Highway's documentation, "foreach_target").
#if defined(BEAMSPREAD_SOLVE_SURFACE_PAIRS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_SOLVE_SURFACE_PAIRS_INL_H
#undef BEAMSPREAD_SOLVE_SURFACE_PAIRS_INL_H
#else
#define BEAMSPREAD_SOLVE_SURFACE_PAIRS_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "solve/surface/pair_sum.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// Length of a chord in the tangent plane, over the chord, below which harmonics fade. Larger: smoother where light
// crosses edges, less exact around balls.
constexpr float steep = 0.5f;

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
    Integers step;  // of the chord, after the first row
    Floats part;  // of the way from its first chord to the next
    Floats per_square;  // 1 / chord^2
    Floats curvature;
    Floats cosine;  // of the chord's azimuth in the tangent plane of the source, times the fade
    Floats sine;
    Floats along;  // half of a cluster's squares over chord^2: those along the chord less a half of all
    Floats across;  // and those of the chord and a line across it, negative
};

// Rows of a group's table around a chord and a curvature, and their weights, for each target.
struct Rows {
    std::array<std::uint32_t, PairTargets::most> first;  // the value of the lower chord and curvature
    std::array<std::uint32_t, PairTargets::most> to_high;  // to that of the next curvature
    std::array<Floats, 4> weight;  // 0 for the next curvature at a node
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

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
