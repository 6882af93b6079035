#include "solve/surface/pair_tables.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/constants.h"

namespace beamspread {

namespace {

// Disks per octave of the radius. More: smaller errors where areas differ, more time and memory.
constexpr float disks_per_octave = 4.0f;

// Chord from which a disk counts as a point, and first chord of its table, in radii. Larger end: smaller errors, more
// time.
constexpr float disk_end_radii = 8.0f;
constexpr float disk_first_radii = 1.0f;

// Least chord of another sample, in radii: it lies outside of the disk. Texels at the rims of UV islands are cut, and their
// middles lie within the disks of their neighbors.
constexpr float disk_begin_radii = 1.125f;

// Fraction of the tolerance that functions may have where they are left out. Larger: less time for light far away.
constexpr double block_share = 0.5;

// Area of the smallest disk over the mean of all samples. Samples below it have hardly any light for others. Smaller: more
// tables, more time.
constexpr float least_disk = 1.0f / 64.0f;

// Least chord, in radii of a disk, at which curvatures are compared: both profiles are infinite at the pole.
constexpr double least_chord = 0.1;

// Step of the chord, relative, for derivatives. Smaller: the profiles' bins and their noise show; larger: less exact.
constexpr double derivative_step = 0.15;

// Standard deviation of the window in which sums over a grid are compared with integrals, in pitches, and its end. Wider:
// more of the kernel, more time.
constexpr double window_width = 1.6;
constexpr int window_end = 8;

// The harmonic 0 of a profile times a Gaussian window, lengths in mean free paths.
class WindowedProfile final : public RadialFunction {
public:
    WindowedProfile(const RadialProfile& profile, double pitch) : m_profile(profile)
    {
        constexpr int steps_per_octave = 32;
        constexpr int octaves = 16;
        for (int i = 0; i <= steps_per_octave * octaves; ++i) {
            m_radii.push_back(window_end * pitch * std::exp2(static_cast<double>(i) / steps_per_octave - octaves));
            const double middle = 0.5 * (m_radii.back() + (i == 0 ? 0.0 : m_radii[m_radii.size() - 2])) / pitch;
            m_window.push_back(std::exp(-0.5 * middle * middle / (window_width * window_width)));
            m_inside.push_back(profile.cumulative(m_radii.back())[0]);
            m_sum.push_back((i == 0 ? 0.0 : m_sum.back()) +
                            m_window.back() * (m_inside.back() - (i == 0 ? 0.0 : m_inside[m_inside.size() - 2])));
        }
    }

    std::size_t harmonics() const override { return 1; }

    Harmonics cumulative(double r) const override
    {
        const auto after =
            static_cast<std::size_t>(std::lower_bound(m_radii.begin(), m_radii.end(), r) - m_radii.begin());
        if (after == m_radii.size())
            return {m_sum.back()};
        return {m_sum[after] - m_window[after] * (m_inside[after] - m_profile.cumulative(r)[0])};
    }

    Harmonics remaining(double r) const override { return {m_sum.back() - cumulative(r)[0]}; }
    double support() const override { return m_radii.back(); }

private:
    const RadialProfile& m_profile;
    std::vector<double> m_radii;   // ascending
    std::vector<double> m_window;  // from the previous radius to this one
    std::vector<double> m_inside;  // of the profile
    std::vector<double> m_sum;     // of the product
};

// Excess of the light of evenly lit disks on a square grid over that of an even plane, per irradiance. It is not 0 where
// the medium spreads about as far as the grid's pitch (Poisson's sum formula).
double grid_excess(const RadialProfile& profile, double radius)
{
    const double pitch = std::sqrt(pi) * radius;
    const WindowedProfile windowed(profile, pitch);
    double sum = 2.0 * pi * windowed.cumulative(radius)[0];
    for (int y = 0; y <= window_end; ++y)
        for (int x = 1; x * x + y * y <= window_end * window_end; ++x)
            sum += 4.0 * pitch * pitch * disk_mean(windowed, radius, pitch * std::hypot(x, y))[0];
    return sum - 2.0 * pi * windowed.cumulative(windowed.support())[0];
}

// Rings of a disk and points on half of each, at which curvatures are compared. More: smaller errors, more time.
constexpr int compared_rings = 4;
constexpr int compared_azimuths = 6;

// Mean of the difference of two profiles over a disk around the chord c: by points of equal area, on one side of the chord,
// since the other is its mirror image.
Harmonics mean_change(const RadialProfile& from, const RadialProfile& to, double c, double radius,
                      std::size_t harmonics)
{
    constexpr double weight = 1.0 / (compared_rings * compared_azimuths);
    Harmonics mean{};
    for (int i = 0; i < compared_rings; ++i)
        for (int j = 0; j < compared_azimuths; ++j) {
            const double ring = radius * std::sqrt((i + 0.5) / compared_rings);
            const double turn = pi * (j + 0.5) / compared_azimuths;
            const double x = c + ring * std::cos(turn);
            const double y = ring * std::sin(turn);
            const double azimuth = std::atan2(y, x);
            const double chord = std::max(std::hypot(x, y), least_chord * radius);
            const Harmonics before = from.density(chord);
            const Harmonics after = to.density(chord);
            for (std::size_t m = 0; m < harmonics; ++m)
                mean[m] += weight * (after[m] - before[m]) * std::cos(static_cast<double>(m) * azimuth);
        }
    return mean;
}

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

}  // namespace

PairTables::PairTables(const SurfaceBasis& basis, const SampleAreas& areas, double tolerance)
    : results(basis.terms.sets.results.size()), blocks(basis.blocks), harmonic(basis.harmonic)
{
    for (const ChannelSets::Result& result : basis.terms.sets.results)
        set.push_back(result.set);
    make_scales(basis);
    for (std::size_t r = 0; r < results; ++r)
        for (std::size_t k = 0; k < scales[r].nodes.size(); ++k)
            for (const ScaledProfile& profile : profiles_of(basis, r, k))
                reach = std::max(reach, static_cast<float>(profile.reach));
    const auto radius_of = [](float area) { return std::sqrt(area * static_cast<float>(inv_pi)); };
    m_first_radius = radius_of(std::max(areas.least, least_disk * areas.mean));
    const float octaves = std::log2(radius_of(areas.most) / m_first_radius);
    disks.resize(static_cast<std::size_t>(std::lround(octaves * disks_per_octave)) + 1);
    for (std::size_t d = 0; d < disks.size(); ++d) {
        const float radius = m_first_radius * std::exp2(static_cast<float>(d) / disks_per_octave);
        disk_begin.push_back(disk_begin_radii * radius);
        disk_end.push_back(disk_end_radii * radius);
        disks[d].first = chord_step(disk_first_radii * radius);
        make_table(basis, disks[d], radius, std::min(disk_end.back(), reach));
    }
    point.first = chord_step(m_first_radius);
    make_table(basis, point, 0.0f, reach);
    choose_blocks(basis, tolerance);
    make_laplacian(basis);
    make_self(basis, radius_of(areas.least), radius_of(areas.most));
}

void PairTables::make_scales(const SurfaceBasis& basis)
{
    for (const ChannelSets::Result& result : basis.terms.sets.results) {
        const ChannelMedium& medium = basis.terms.sets.media[result.medium];
        CurvatureScale scale;
        for (const double curvature : basis.curvatures[result.medium])
            scale.nodes.push_back(static_cast<float>(curvature / medium.mean_free_path));
        if (scale.nodes.size() > 1) {
            const float width = scale.nodes.back() - scale.nodes.front();
            scale.per_step = static_cast<float>(CurvatureScale::steps) / width;
            for (std::size_t i = 0; i < CurvatureScale::steps; ++i) {
                const float middle = scale.nodes.front() + (static_cast<float>(i) + 0.5f) / scale.per_step;
                const auto above = std::upper_bound(scale.nodes.begin() + 1, scale.nodes.end() - 1, middle);
                scale.interval[i] = static_cast<std::uint8_t>(above - scale.nodes.begin() - 1);
            }
        }
        scales.push_back(std::move(scale));
    }
}

void PairTables::make_table(const SurfaceBasis& basis, ChordTable& table, float radius, float end) const
{
    table.rows = std::max(chord_step(end), table.first) - table.first + 2;
    struct Item {
        std::size_t result, curvature, rank;
    };
    std::vector<Item> items;
    for (std::size_t r = 0; r < results; ++r) {
        const std::size_t nodes = scales[r].nodes.size();
        table.values.emplace_back(nodes * table.rows * blocks * lanes_per_block, 0.0f);
        for (std::size_t k = 0; k < nodes; ++k)
            for (std::size_t rank = 0; rank < profiles_of(basis, r, k).size(); ++rank)
                items.push_back({r, k, rank});
    }
    const std::size_t lanes = blocks * lanes_per_block;
    // Fills the functions of one item, of c^2 times `value(profile, c)` at each chord c in mean free paths.
    const auto fill = [&](const Item& item, const auto& value) {
        const ScaledProfile& scaled = profiles_of(basis, item.result, item.curvature)[item.rank];
        float* values = table.values[item.result].data() + item.curvature * table.rows * lanes;
        for (std::size_t row = 0; row < table.rows; ++row, values += lanes) {
            const auto chord = static_cast<double>(chord_of(table.first + static_cast<std::uint32_t>(row)));
            if (chord > scaled.reach + static_cast<double>(radius))
                break;
            const double c = chord / scaled.mean_free_path;
            const Harmonics at_chord = value(scaled, c);
            for (std::size_t lane = 0; lane < basis.rank.size(); ++lane)
                if (basis.rank[lane] == item.rank)
                    values[lane] += static_cast<float>(at_chord[static_cast<std::size_t>(harmonic[lane])] * c * c);
        }
    };
    if (radius == 0.0f) {
        parallel_for(items.size(), [&](std::size_t i) {
            fill(items[i], [](const ScaledProfile& scaled, double c) { return scaled.profile.density(c); });
        });
        return;
    }
    const auto harmonics = static_cast<std::size_t>(*std::max_element(harmonic.begin(), harmonic.end())) + 1;
    // Means over a disk take long. Curvature changes profiles by functions that are smooth at the pole: few points are
    // enough for the mean of the change.
    std::vector<Item> flat;
    std::copy_if(items.begin(), items.end(), std::back_inserter(flat),
                 [&](const Item& item) { return item.curvature == flat_index(basis, item.result); });
    parallel_for(flat.size(), [&](std::size_t i) {
        fill(flat[i], [radius](const ScaledProfile& scaled, double c) {
            return disk_mean(scaled.profile, static_cast<double>(radius) / scaled.mean_free_path, c);
        });
    });
    parallel_for(items.size(), [&](std::size_t i) {
        const Item& item = items[i];
        const std::size_t plane = flat_index(basis, item.result);
        if (item.curvature == plane)
            return;
        const std::size_t size = table.rows * lanes;
        float* values = table.values[item.result].data();
        const float end_of_ball = static_cast<float>(profiles_of(basis, item.result, item.curvature)[item.rank].reach);
        for (std::size_t at = 0; at < size; ++at)
            if (chord_of(table.first + static_cast<std::uint32_t>(at / lanes)) > end_of_ball + radius)
                break;
            else if (const std::size_t lane = at % lanes; lane < basis.rank.size() && basis.rank[lane] == item.rank)
                values[item.curvature * size + at] = values[plane * size + at];
        const ScaledProfile& of_plane = profiles_of(basis, item.result, plane)[item.rank];
        fill(item, [&](const ScaledProfile& scaled, double c) {
            return mean_change(of_plane.profile, scaled.profile, c, static_cast<double>(radius) / scaled.mean_free_path,
                               harmonics);
        });
    });
}

void PairTables::choose_blocks(const SurfaceBasis& basis, double tolerance)
{
    const std::size_t lanes = blocks * lanes_per_block;
    point_blocks.assign(point.rows, 0);
    for (std::size_t r = 0; r < results; ++r) {
        // Power beyond a chord of each block and those after it; the light is at its most in each function.
        std::vector<double> beyond(blocks);
        double all = 0.0;
        for (const bool is_known : {false, true})
            for (std::size_t row = point.rows; row-- > 0;) {
                std::vector<double> power(blocks);
                for (std::size_t lane = 0; lane < basis.largest.size(); ++lane) {
                    float value = 0.0f;
                    for (std::size_t k = 0; k < scales[r].nodes.size(); ++k)
                        value = std::max(value, std::abs(point.values[r][(k * point.rows + row) * lanes + lane]));
                    for (std::size_t b = 0; b <= lane / lanes_per_block; ++b)
                        power[b] += static_cast<double>(value * basis.largest[lane]);
                }
                const float chord = chord_of(point.first + static_cast<std::uint32_t>(row));
                const float next = chord_of(point.first + static_cast<std::uint32_t>(row + 1));
                const double octave = std::log(static_cast<double>(next / chord));
                if (!is_known) {
                    all += octave * power[0];
                    continue;
                }
                for (std::size_t b = 0; b < blocks; ++b) {
                    beyond[b] += octave * power[b];
                    if (beyond[b] > block_share * tolerance * all)
                        point_blocks[row] = std::max(point_blocks[row], static_cast<std::uint8_t>(b + 1));
                }
            }
    }
}

void PairTables::make_laplacian(const SurfaceBasis& basis)
{
    laplacian.first = point.first;
    laplacian.rows = point.rows;
    const std::size_t lanes = blocks * lanes_per_block;
    for (std::size_t r = 0; r < results; ++r) {
        const std::size_t nodes = scales[r].nodes.size();
        AlignedVector<float>& values = laplacian.values.emplace_back(point.values[r].size(), 0.0f);
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
                for (std::size_t lane = 0; lane < basis.rank.size(); ++lane) {
                    if (basis.rank[lane] != rank)
                        continue;
                    const auto m = static_cast<std::size_t>(harmonic[lane]);
                    const double second = (before[m] - 2.0 * here[m] + after[m]) / (derivative_step * derivative_step);
                    const double first = (after[m] - before[m]) / (2.0 * derivative_step);
                    values[item * lanes + lane] = static_cast<float>(
                        (second + first - static_cast<double>(m * m) * here[m]) * in_paths * in_paths);
                }
            }
        });
    }
}

void PairTables::make_self(const SurfaceBasis& basis, float min_radius, float max_radius)
{
    m_self.first = chord_step(min_radius);
    m_self.rows = chord_step(max_radius) - m_self.first + 2;
    for (std::size_t r = 0; r < results; ++r) {
        m_self.values.emplace_back(m_self.rows * blocks * lanes_per_block, 0.0f);
        const std::size_t flat = flat_index(basis, r);
        const std::vector<ScaledProfile>& profiles = profiles_of(basis, r, flat);
        parallel_for(basis.rank.size(), [&](std::size_t lane) {
            const std::size_t rank = basis.rank[lane];
            if (harmonic[lane] != 0)
                return;
            std::vector<double> excess;  // [disk]
            for (const float end : disk_end)
                excess.push_back(grid_excess(
                    profiles[rank].profile, static_cast<double>(end / disk_end_radii) / profiles[rank].mean_free_path));
            for (std::size_t row = 0; row < m_self.rows; ++row) {
                const float radius = chord_of(m_self.first + static_cast<std::uint32_t>(row));
                const double position =
                    std::clamp(static_cast<double>(std::log2(radius / m_first_radius) * disks_per_octave), 0.0,
                               static_cast<double>(disks.size() - 1));
                const auto before = static_cast<std::size_t>(position);
                const std::size_t after = std::min(before + 1, disks.size() - 1);
                const double smaller = std::min(static_cast<double>(radius / m_first_radius), 1.0);
                const double there =
                    smaller * smaller * std::lerp(excess[before], excess[after], position - std::floor(position));
                const double within =
                    profiles[rank].profile.cumulative(static_cast<double>(radius) / profiles[rank].mean_free_path)[0];
                m_self.values[r][row * blocks * lanes_per_block + lane] = static_cast<float>(2.0 * pi * within - there);
            }
        });
    }
}

std::vector<double> PairTables::second_derivatives(std::size_t result) const
{
    const std::size_t lanes = blocks * lanes_per_block;
    std::vector<double> bounds(point.rows);
    double largest = 0.0;
    for (std::size_t row = point.rows; row-- > 0;) {
        const auto chord = static_cast<double>(chord_of(point.first + static_cast<std::uint32_t>(row)));
        float value = 0.0f;
        for (std::size_t k = 0; k < scales[result].nodes.size(); ++k) {
            const std::size_t at = (k * point.rows + row) * lanes;
            value = std::max({value, std::abs(point.values[result][at]), std::abs(laplacian.values[result][at])});
        }
        largest = std::max(largest, static_cast<double>(value) / (chord * chord * chord * chord));
        bounds[row] = largest;
    }
    return bounds;
}

std::size_t PairTables::disk(float area) const
{
    const float radius = std::sqrt(area * static_cast<float>(inv_pi));
    const auto nearest = std::lround(std::log2(radius / m_first_radius) * disks_per_octave);
    return std::min(static_cast<std::size_t>(std::max(nearest, 0L)), disks.size() - 1);
}

void PairTables::add_self(float area, std::size_t result, float* factors) const
{
    const float radius = std::sqrt(area * static_cast<float>(inv_pi));
    const std::uint32_t step = std::clamp(chord_step(radius), m_self.first, m_self.first + m_self.rows - 2);
    const float before = chord_of(step);
    const float part = std::clamp((radius - before) / (chord_of(step + 1) - before), 0.0f, 1.0f);
    const std::size_t lanes = blocks * lanes_per_block;
    const float* values = m_self.values[result].data() + (step - m_self.first) * lanes;
    for (std::size_t i = 0; i < lanes; ++i)
        factors[i] += values[i] + part * (values[lanes + i] - values[i]);
}

}  // namespace beamspread
