#include "solve/surface/pair_tables.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

// Disks per octave of the radius. More: smaller errors where areas differ, more time and memory.
constexpr int disks_per_octave = 4;

// Area of the smallest disk over the mean of all samples. Samples below it have hardly any light for others. Smaller: more
// tables, more time.
constexpr float least_disk = 1.0f / 64.0f;

static_assert(SurfaceKernels::radii_per_octave % disks_per_octave == 0);

}  // namespace

PairTables::PairTables(SurfaceKernels& kernels, const SampleAreas& areas)
    : lanes(kernels.basis().lanes), reach(kernels.reach())
{
    const SurfaceBasis& basis = kernels.basis();
    make_scales(basis);
    const auto radius_of = [](float area) { return std::sqrt(area * static_cast<float>(inv_pi)); };
    const auto number_of = [](float radius) {
        return static_cast<int>(std::lround(std::log2(radius) * SurfaceKernels::radii_per_octave));
    };
    constexpr int step = SurfaceKernels::radii_per_octave / disks_per_octave;
    const float first_radius = radius_of(std::max(areas.least, least_disk * areas.mean));
    const int first = number_of(first_radius);
    const float octaves = std::log2(radius_of(areas.most) / first_radius);
    const int last = first + step * static_cast<int>(std::lround(octaves * disks_per_octave));
    m_disk_step = 1.0 / disks_per_octave;
    for (int number = first; number <= last; number += step)
        disks.push_back(kernels.disk(number));
    point = kernels.point(static_cast<int>(std::floor(std::log2(first_radius))));
    make_self(basis, radius_of(areas.least), radius_of(areas.most));
    if (areas.most_uneven > 0.0f)
        make_within(basis, areas.most_uneven);
}

void PairTables::make_scales(const SurfaceBasis& basis)
{
    const std::vector<double> first = curvatures_of(basis, 0);
    least_curvature = static_cast<float>(first.front());
    most_curvature = static_cast<float>(first.back());
    for (std::size_t group = 0; group < lanes.groups; ++group) {
        CurvatureScale scale;
        for (const double curvature : group_curvatures(basis, group))
            scale.nodes.push_back(static_cast<float>(curvature));
        if (scale.nodes.size() > 1) {
            for (std::size_t k = 0; k + 1 < scale.nodes.size(); ++k)
                scale.per_width.push_back(1.0f / (scale.nodes[k + 1] - scale.nodes[k]));
            const auto flat = std::lower_bound(scale.nodes.begin(), scale.nodes.end(), 0.0f) - scale.nodes.begin();
            if (scale.nodes.size() > 2)
                scale.middle = std::clamp<std::size_t>(static_cast<std::size_t>(flat), 1, scale.nodes.size() - 2);
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

void PairTables::make_self(const SurfaceBasis& basis, float min_radius, float max_radius)
{
    m_self.first = chord_step(min_radius);
    m_self.rows = chord_step(max_radius) - m_self.first + 2;
    m_self.values.resize(lanes.groups, AlignedVector<float>(m_self.rows * lanes.lanes(), 0.0f));
    for (std::size_t r = 0; r < lanes.results; ++r) {
        const std::size_t flat = flat_index(basis, r);
        const std::vector<ScaledProfile>& profiles = profiles_of(basis, r, flat);
        parallel_for(basis.functions(), [&](std::size_t f) {
            const std::size_t rank = basis.rank[f];
            if (basis.harmonic[f] != 0)
                return;
            for (std::size_t row = 0; row < m_self.rows; ++row) {
                const float radius = chord_of(m_self.first + static_cast<std::uint32_t>(row));
                const double within =
                    profiles[rank].profile.cumulative(static_cast<double>(radius) / profiles[rank].mean_free_path)[0];
                m_self.values[lanes.group(r)][row * lanes.lanes() + lanes.lane(r, f)] =
                    static_cast<float>(2.0 * pi * within);
            }
        });
    }
}

void PairTables::make_within(const SurfaceBasis& basis, float most_uneven)
{
    m_within.first = chord_step(least_ring * disks.front()->radius);
    m_within.rows =
        std::max(chord_step(near_sides * most_uneven), m_within.first) - m_within.first + steps_per_ring + 1;
    m_within.values.resize(lanes.groups, AlignedVector<float>(m_within.rows * lanes.lanes(), 0.0f));
    for (std::size_t r = 0; r < lanes.results; ++r) {
        const std::vector<ScaledProfile>& profiles = profiles_of(basis, r, flat_index(basis, r));
        parallel_for(m_within.rows, [&](std::size_t row) {
            const auto radius = static_cast<double>(chord_of(m_within.first + static_cast<std::uint32_t>(row)));
            std::vector<Harmonics> within;
            for (const ScaledProfile& scaled : profiles)
                within.push_back(scaled.profile.cumulative(radius / scaled.mean_free_path));
            for (std::size_t f = 0; f < basis.functions(); ++f)
                m_within.values[lanes.group(r)][row * lanes.lanes() + lanes.lane(r, f)] =
                    static_cast<float>(within[basis.rank[f]][static_cast<std::size_t>(basis.harmonic[f])]);
        });
    }
}

std::vector<double> PairTables::second_derivatives(std::size_t result) const
{
    const std::size_t group = lanes.group(result);
    std::vector<double> bounds(point->light.rows);
    double largest = 0.0;
    for (std::size_t row = point->light.rows; row-- > 0;) {
        const auto chord = static_cast<double>(chord_of(point->light.first + static_cast<std::uint32_t>(row)));
        float value = 0.0f;
        for (std::size_t k = 0; k < scales[group].nodes.size(); ++k) {
            const std::size_t at = (k * point->light.rows + row) * lanes.lanes() + lanes.lane(result, 0);
            value = std::max(
                {value, std::abs(point->light.values[group][at]), std::abs(point->laplacian.values[group][at])});
        }
        largest = std::max(largest, static_cast<double>(value) / (chord * chord * chord * chord));
        bounds[row] = largest;
    }
    return bounds;
}

double PairTables::place_of(float radius) const
{
    return static_cast<double>(std::log2(radius / disks.front()->radius)) / m_disk_step;
}

std::size_t PairTables::disk(float area) const
{
    const auto nearest = std::lround(place_of(std::sqrt(area * static_cast<float>(inv_pi))));
    return std::min(static_cast<std::size_t>(std::max(nearest, 0L)), disks.size() - 1);
}

void PairTables::add_self_light(float area, float neighbors, const LatticeShape& lattice, const float* moments,
                                float* sums) const
{
    const float radius = std::sqrt(area * static_cast<float>(inv_pi));
    const std::uint32_t step = std::clamp(chord_step(radius), m_self.first, m_self.first + m_self.rows - 2);
    const float before = chord_of(step);
    const float part = std::clamp((radius - before) / (chord_of(step + 1) - before), 0.0f, 1.0f);
    const std::size_t count = lanes.lanes();

    // Excess of the light of all samples around. That of smaller disks than any is in proportion to their area.
    const auto place = static_cast<float>(std::clamp(place_of(radius), 0.0, static_cast<double>(disks.size() - 1)));
    const float nearest = std::nearbyint(place);
    const DiskTable& disk = *disks[static_cast<std::size_t>(nearest)];
    const float smaller = std::min(radius / disks.front()->radius, 1.0f);
    const Neighborhoods near(lattice, (neighbors - place) * static_cast<float>(m_disk_step));
    std::array<Vec2f, surface_harmonics> turned{Vec2f(1.0f, 0.0f)};
    for (std::size_t m = 1; m < surface_harmonics; ++m) {
        const Vec2f& last = turned[m - 1];
        turned[m] = {last.x * lattice.shortest.x - last.y * lattice.shortest.y,
                     last.x * lattice.shortest.y + last.y * lattice.shortest.x};
    }
    const float mirrored = lattice.is_mirrored ? -1.0f : 1.0f;
    for (std::size_t group = 0; group < lanes.groups; ++group) {
        const float* within = m_self.values[group].data() + (step - m_self.first) * count;
        const float* of_set = moments + lanes.set[group] * 2 * count;
        for (std::size_t b = 0; b < lanes.blocks; ++b) {
            std::array<float, lanes_per_block> cosine{}, sine{};
            for (std::size_t n = 0; n < near.index.size(); ++n) {
                const float* values = disk.excess[group].data() + near.index[n] * 2 * count + b * lanes_per_block;
                const float weight = smaller * smaller * near.weight[n];
                for (std::size_t k = 0; k < lanes_per_block; ++k) {
                    cosine[k] += weight * values[k];
                    sine[k] += weight * values[count + k];
                }
            }
            const float* light = of_set + b * 2 * lanes_per_block;
            std::array<float, lanes_per_block> product;
            for (std::size_t k = 0; k < lanes_per_block; ++k) {
                const std::size_t lane = b * lanes_per_block + k;
                const Vec2f& turn = turned[static_cast<std::size_t>(lanes.harmonic[lane])];
                const float own = within[lane] + part * (within[count + lane] - within[lane]);
                product[k] = (own - cosine[k] * turn.x + mirrored * sine[k] * turn.y) * light[k] -
                             (cosine[k] * turn.y + mirrored * sine[k] * turn.x) * light[lanes_per_block + k];
            }
            lanes.add(group, product.data(), sums);
        }
    }
}

void PairTables::add_uneven_light(const UnevenRings& rings, const float* moments, float* sums) const
{
    const std::size_t count = lanes.lanes();
    for (std::size_t group = 0; group < lanes.groups; ++group) {
        const float* first = m_within.values[group].data() + (rings.first - m_within.first) * count;
        const float* of_set = moments + lanes.set[group] * 2 * count;
        for (std::size_t b = 0; b < lanes.blocks; ++b) {
            std::array<float, lanes_per_block> cosine{}, sine{}, product{};
            for (std::size_t k = 0; k < lanes_per_block; ++k) {
                const std::size_t lane = b * lanes_per_block + k;
                const auto m = static_cast<std::size_t>(lanes.harmonic[lane]);
                if (m >= uneven_harmonics)
                    continue;
                const float* within = first + lane;
                if (m == 0)
                    cosine[k] = static_cast<float>(2.0 * pi) * *within;
                for (const RingIntegrals& left : rings.left) {
                    const float ring = within[steps_per_ring * count] - *within;
                    cosine[k] += left[2 * m] * ring;
                    sine[k] += left[2 * m + 1] * ring;
                    within += steps_per_ring * count;
                }
                const float* light = of_set + b * 2 * lanes_per_block + k;
                product[k] = cosine[k] * light[0] + sine[k] * light[lanes_per_block];
            }
            lanes.add(group, product.data(), sums);
        }
    }
}

}  // namespace beamspread
