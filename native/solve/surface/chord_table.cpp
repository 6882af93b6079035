#include "solve/surface/chord_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/constants.h"
#include "solve/surface/lattice_excess.h"

namespace beamspread {

namespace {

// Chord from which a disk counts as a point, and first chord of its table, in radii. Larger end: smaller errors, more
// time.
constexpr float disk_end_radii = 8.0f;
constexpr float disk_first_radii = 1.0f;

// Fraction of the tolerance that functions may have where they are left out. Larger: less time for light far away, and
// larger errors, since those of all distances add up.
constexpr double block_share = 0.1;

// Least chord, in radii of a disk, at which curvatures are compared: both profiles are infinite at the pole.
constexpr double least_chord = 0.1;

// Step of the chord, relative, for derivatives. Smaller: the profiles' bins and their noise show; larger: less exact.
constexpr double derivative_step = 0.15;

// Least distance of two curvatures of shared tables, over the range of all. Nearer ones count as one.
constexpr double least_node_distance = 1e-6;

// Rings of a disk and points on half of each, at which curvatures are compared. More: smaller errors, more time.
constexpr std::size_t compared_rings = 4;
constexpr std::size_t compared_azimuths = 6;

// Points of equal area of a disk around the end of a chord, on one side of the chord: the other is its mirror image.
struct DiskPoints {
    static constexpr std::size_t count = compared_rings * compared_azimuths;
    std::array<double, count> chord;  // in the unit of the radius
    std::array<std::array<double, surface_harmonics>, count> cosines;  // of m times the azimuth

    DiskPoints(double c, double radius)
    {
        for (std::size_t p = 0; p < count; ++p) {
            const std::size_t number = p / compared_azimuths;
            const double ring =
                radius * std::sqrt((static_cast<double>(number) + 0.5) / static_cast<double>(compared_rings));
            const double turn =
                pi * (static_cast<double>(p % compared_azimuths) + 0.5) / static_cast<double>(compared_azimuths);
            const double x = c + ring * std::cos(turn);
            const double y = ring * std::sin(turn);
            const double azimuth = std::atan2(y, x);
            chord[p] = std::max(std::hypot(x, y), least_chord * radius);
            for (std::size_t m = 0; m < surface_harmonics; ++m)
                cosines[p][m] = std::cos(static_cast<double>(m) * azimuth);
        }
    }

    // Mean of a profile, whose mean free path is in the unit of the radius.
    Harmonics mean(const ScaledProfile& scaled) const
    {
        Harmonics sums{};
        for (std::size_t p = 0; p < count; ++p) {
            const Harmonics density = scaled.profile.density(chord[p] / scaled.mean_free_path);
            for (std::size_t m = 0; m < surface_harmonics; ++m)
                sums[m] += density[m] * cosines[p][m];
        }
        for (std::size_t m = 0; m < surface_harmonics; ++m)
            sums[m] /= static_cast<double>(count);
        return sums;
    }
};

// Largest value of each function of a row, of all curvatures, where the light is at its most in each function.
std::vector<double> largest_values(const SurfaceBasis& basis, const ChordTable& point, std::size_t result,
                                   std::size_t row)
{
    std::vector<double> largest(basis.functions());
    const std::size_t group = basis.lanes.group(result);
    const std::size_t lanes = basis.lanes.lanes();
    const std::size_t curvatures = point.values[group].size() / (point.rows * lanes);
    for (std::size_t f = 0; f < largest.size(); ++f) {
        const float* values = point.values[group].data() + row * lanes + basis.lanes.lane(result, f);
        float value = 0.0f;
        for (std::size_t k = 0; k < curvatures; ++k)
            value = std::max(value, std::abs(values[k * point.rows * lanes]));
        largest[f] = static_cast<double>(value * basis.largest[f]);
    }
    return largest;
}

void choose_blocks(const SurfaceBasis& basis, double tolerance, PointTable& table)
{
    const ChordTable& point = table.light;
    table.blocks.assign(point.rows, {});
    for (std::size_t r = 0; r < basis.lanes.results; ++r) {
        // Power beyond a chord of each block and those after it.
        std::vector<double> beyond(basis.lanes.blocks);
        double all = 0.0;
        bool is_lit = false;
        for (const bool is_known : {false, true})
            for (std::size_t row = point.rows; row-- > 0;) {
                std::vector<double> power(basis.lanes.blocks);
                const std::vector<double> largest = largest_values(basis, point, r, row);
                for (std::size_t f = 0; f < largest.size(); ++f)
                    for (std::size_t b = 0; b <= basis.lanes.lane(r, f) / lanes_per_block; ++b)
                        power[b] += largest[f];
                const float chord = chord_of(point.first + static_cast<std::uint32_t>(row));
                const float next = chord_of(point.first + static_cast<std::uint32_t>(row + 1));
                const double octave = std::log(static_cast<double>(next / chord));
                if (!is_known) {
                    all += octave * power[0];
                    continue;
                }
                // Far light that the first block leaves out has one sign, so that errors add up: the block stays as long as there is light.
                is_lit = is_lit || power[0] > 0.0;
                std::uint8_t& blocks = table.blocks[row][basis.lanes.group(r)];
                for (std::size_t b = 0; b < basis.lanes.blocks; ++b) {
                    beyond[b] += octave * power[b];
                    if (b == 0 ? is_lit : beyond[b] > block_share * tolerance * all)
                        blocks = std::max(blocks, static_cast<std::uint8_t>(b + 1));
                }
            }
    }
}

// Values of a table at a curvature, 1 / metre, by those of a result at its nodes: index of the lower one, and the part of
// the way to the next.
std::pair<std::size_t, double> find_node(const std::vector<double>& nodes, double curvature)
{
    if (nodes.size() == 1 || curvature <= nodes.front())
        return {0, 0.0};
    if (curvature >= nodes.back())
        return {nodes.size() - 2, 1.0};
    const auto above = std::upper_bound(nodes.begin(), nodes.end(), curvature);
    const auto k = static_cast<std::size_t>(above - nodes.begin()) - 1;
    return {k, (curvature - nodes[k]) / (nodes[k + 1] - nodes[k])};
}

// Turns values of each result, [curvature][row][function], into those of groups of lanes.
void place_in_lanes(const SurfaceBasis& basis, ChordTable& table)
{
    const std::size_t functions = basis.functions();
    const std::size_t lanes = basis.lanes.lanes();
    std::vector<AlignedVector<float>> groups(basis.lanes.groups);
    for (std::size_t r = 0; r < basis.lanes.results; ++r) {
        const std::size_t group = basis.lanes.group(r);
        const std::vector<double> all = group_curvatures(basis, group);
        const std::vector<double> own = curvatures_of(basis, r);
        groups[group].resize(all.size() * table.rows * lanes, 0.0f);
        for (std::size_t k = 0; k < all.size(); ++k) {
            const auto [low, part] = find_node(own, all[k]);
            const float to_next = static_cast<float>(part);
            for (std::size_t row = 0; row < table.rows; ++row) {
                const float* from = table.values[r].data() + (low * table.rows + row) * functions;
                const float* next = to_next > 0.0f ? from + table.rows * functions : from;
                float* to = groups[group].data() + (k * table.rows + row) * lanes;
                for (std::size_t f = 0; f < functions; ++f)
                    to[basis.lanes.lane(r, f)] = from[f] + to_next * (next[f] - from[f]);
            }
        }
    }
    table.values = std::move(groups);
}

void make_derivatives(const SurfaceBasis& basis, PointTable& table)
{
    const ChordTable& point = table.light;
    ChordTable& laplacian = table.laplacian;
    laplacian.first = point.first;
    laplacian.rows = point.rows;
    table.along = laplacian;
    table.across = laplacian;
    const std::size_t lanes = basis.functions();
    for (std::size_t r = 0; r < basis.lanes.results; ++r) {
        const std::size_t nodes = curvature_count(basis, r);
        AlignedVector<float>& values = laplacian.values.emplace_back(nodes * point.rows * lanes, 0.0f);
        AlignedVector<float>& along = table.along.values.emplace_back(values.size(), 0.0f);
        AlignedVector<float>& across = table.across.values.emplace_back(values.size(), 0.0f);
        parallel_for(nodes * point.rows, [&](std::size_t item) {
            const std::size_t curvature = item / point.rows;
            const std::size_t row = item % point.rows;
            const auto c = static_cast<double>(chord_of(point.first + static_cast<std::uint32_t>(row)));
            const std::vector<ScaledProfile>& profiles = profiles_of(basis, r, curvature);
            for (std::size_t rank = 0; rank < profiles.size(); ++rank) {
                const double in_paths = c / profiles[rank].mean_free_path;
                const auto at = [&](double ratio) { return profiles[rank].profile.density(in_paths * ratio); };
                if (c * (1.0 + derivative_step) > profiles[rank].reach)
                    continue;
                const Harmonics before = at(1.0 - derivative_step);
                const Harmonics here = at(1.0);
                const Harmonics after = at(1.0 + derivative_step);
                for (std::size_t f = 0; f < lanes; ++f) {
                    if (basis.rank[f] != rank)
                        continue;
                    const auto m = static_cast<std::size_t>(basis.harmonic[f]);
                    const double second = (before[m] - 2.0 * here[m] + after[m]) / (derivative_step * derivative_step);
                    const double first = (after[m] - before[m]) / (2.0 * derivative_step);
                    values[item * lanes + f] = static_cast<float>(
                        (second + first - static_cast<double>(m * m) * here[m]) * in_paths * in_paths);
                    along[item * lanes + f] = static_cast<float>(
                        (second - first + static_cast<double>(m * m) * here[m]) * in_paths * in_paths);
                    across[item * lanes + f] =
                        static_cast<float>((static_cast<double>(2 * m) * (here[m] - first)) * in_paths * in_paths);
                }
            }
        });
    }
    for (ChordTable* derivative : {&table.laplacian, &table.along, &table.across})
        place_in_lanes(basis, *derivative);
}

}  // namespace

const std::vector<ScaledProfile>& profiles_of(const SurfaceBasis& basis, std::size_t result, std::size_t curvature)
{
    const std::size_t medium = basis.terms.sets.results[result].medium;
    return basis.terms.basis.profiles[basis.first_profiles[medium] + curvature];
}

std::size_t flat_index(const SurfaceBasis& basis, std::size_t result)
{
    const std::vector<double>& nodes = basis.curvatures[basis.terms.sets.results[result].medium];
    return static_cast<std::size_t>(std::find(nodes.begin(), nodes.end(), 0.0) - nodes.begin());
}

std::size_t curvature_count(const SurfaceBasis& basis, std::size_t result)
{
    return basis.curvatures[basis.terms.sets.results[result].medium].size();
}

std::vector<double> curvatures_of(const SurfaceBasis& basis, std::size_t result)
{
    const std::size_t medium = basis.terms.sets.results[result].medium;
    std::vector<double> nodes = basis.curvatures[medium];
    for (double& node : nodes)
        node /= basis.terms.sets.media[medium].mean_free_path;
    return nodes;
}

std::vector<double> group_curvatures(const SurfaceBasis& basis, std::size_t group)
{
    if (!basis.lanes.is_shared())
        return curvatures_of(basis, group);
    std::vector<double> all;
    for (std::size_t r = 0; r < basis.lanes.results; ++r)
        for (const double node : curvatures_of(basis, r))
            all.push_back(node);
    std::sort(all.begin(), all.end());
    const double width = all.back() - all.front();
    const auto is_same = [width](double a, double b) { return b - a <= least_node_distance * width; };
    all.erase(std::unique(all.begin(), all.end(), is_same), all.end());
    return all;
}

void fill_chord_table(const SurfaceBasis& basis, ChordTable& table, float radius, float end)
{
    table.rows = std::max(chord_step(end), table.first) - table.first + 2;
    struct Item {
        std::size_t result, rank;
    };
    std::vector<Item> items;
    const std::size_t lanes = basis.functions();
    for (std::size_t r = 0; r < basis.terms.sets.results.size(); ++r) {
        table.values.emplace_back(curvature_count(basis, r) * table.rows * lanes, 0.0f);
        for (std::size_t rank = 0; rank < profiles_of(basis, r, 0).size(); ++rank)
            items.push_back({r, rank});
    }
    const auto chord_at = [&](std::size_t row) {
        return static_cast<double>(chord_of(table.first + static_cast<std::uint32_t>(row)));
    };
    const auto reaches = [&](const ScaledProfile& scaled, double chord) {
        return chord <= scaled.reach + static_cast<double>(radius);
    };
    // Writes the functions of an item at a row, of c^2 times those in `at_chord`, c in mean free paths.
    const auto write = [&](const Item& item, std::size_t curvature, std::size_t row, const Harmonics& at_chord) {
        const double c = chord_at(row) / profiles_of(basis, item.result, curvature)[item.rank].mean_free_path;
        float* values = table.values[item.result].data() + (curvature * table.rows + row) * lanes;
        for (std::size_t f = 0; f < lanes; ++f)
            if (basis.rank[f] == item.rank)
                values[f] = static_cast<float>(at_chord[static_cast<std::size_t>(basis.harmonic[f])] * c * c);
    };
    if (radius == 0.0f) {
        parallel_for(items.size(), [&](std::size_t i) {
            for (std::size_t k = 0; k < curvature_count(basis, items[i].result); ++k) {
                const ScaledProfile& scaled = profiles_of(basis, items[i].result, k)[items[i].rank];
                for (std::size_t row = 0; row < table.rows && reaches(scaled, chord_at(row)); ++row)
                    write(items[i], k, row, scaled.profile.density(chord_at(row) / scaled.mean_free_path));
            }
        });
        place_in_lanes(basis, table);
        return;
    }
    // Means over a disk take long. Curvature changes profiles by functions that are smooth at the pole: few points are
    // enough for the mean of the change.
    parallel_for(items.size() * table.rows, [&](std::size_t number) {
        const Item& item = items[number / table.rows];
        const std::size_t row = number % table.rows;
        const std::size_t plane = flat_index(basis, item.result);
        const ScaledProfile& flat = profiles_of(basis, item.result, plane)[item.rank];
        const double chord = chord_at(row);
        Harmonics of_plane{};
        if (reaches(flat, chord)) {
            const double path = flat.mean_free_path;
            of_plane = disk_mean(flat.profile, static_cast<double>(radius) / path, chord / path);
            write(item, plane, row, of_plane);
        }
        std::optional<DiskPoints> points;
        Harmonics of_points{};
        for (std::size_t k = 0; k < curvature_count(basis, item.result); ++k) {
            const ScaledProfile& scaled = profiles_of(basis, item.result, k)[item.rank];
            if (k == plane || !reaches(scaled, chord))
                continue;
            if (!points) {
                points.emplace(chord, static_cast<double>(radius));
                of_points = points->mean(flat);
            }
            Harmonics mean = points->mean(scaled);
            for (std::size_t m = 0; m < surface_harmonics; ++m)
                mean[m] += of_plane[m] - of_points[m];
            write(item, k, row, mean);
        }
    });
    place_in_lanes(basis, table);
}

DiskTable make_disk(const SurfaceBasis& basis, float radius, float reach)
{
    DiskTable disk{radius, disk_begin_radii * radius, disk_end_radii * radius, {}, {}};
    disk.light.first = chord_step(disk_first_radii * radius);
    fill_chord_table(basis, disk.light, radius, std::min(disk.end, reach));
    const std::size_t lanes = basis.lanes.lanes();
    disk.excess.resize(basis.lanes.groups, AlignedVector<float>(neighborhood_count * 2 * lanes, 0.0f));
    for (std::size_t r = 0; r < basis.lanes.results; ++r) {
        AlignedVector<float>& excess = disk.excess[basis.lanes.group(r)];
        const std::vector<ScaledProfile>& profiles = profiles_of(basis, r, flat_index(basis, r));
        parallel_for(profiles.size(), [&](std::size_t rank) {
            std::size_t harmonics = 0;
            for (std::size_t f = 0; f < basis.functions(); ++f)
                if (const auto m = static_cast<std::size_t>(basis.harmonic[f]); basis.rank[f] == rank && m % 2 == 0)
                    harmonics = std::max(harmonics, m / 2 + 1);
            const std::vector<double> of_rank = lattice_excess(
                profiles[rank].profile, static_cast<double>(radius) / profiles[rank].mean_free_path, harmonics);
            for (std::size_t f = 0; f < basis.functions(); ++f) {
                const auto m = static_cast<std::size_t>(basis.harmonic[f]);
                if (basis.rank[f] != rank || m % 2 != 0)
                    continue;
                for (std::size_t row = 0; row < 2 * neighborhood_count; ++row)
                    excess[row * lanes + basis.lanes.lane(r, f)] =
                        static_cast<float>(of_rank[(row / 2 * even_harmonics + m / 2) * 2 + row % 2]);
            }
        });
    }
    return disk;
}

PointTable make_point(const SurfaceBasis& basis, float first, float reach, double tolerance)
{
    PointTable point;
    point.light.first = chord_step(first);
    fill_chord_table(basis, point.light, 0.0f, reach);
    choose_blocks(basis, tolerance, point);
    make_derivatives(basis, point);
    return point;
}

}  // namespace beamspread
