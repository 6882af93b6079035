#include "solve/adaptive/multilevel_sum.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/threads.h"
#include "simd/loops.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

namespace {

// Coarse points [first, first + count) around a fine point, with their weights in cubic interpolation (Brandt, Lubrecht
// 1990, J. Comput. Phys. 90, 348). On a halved axis, coarse point j is fine point 2 (j - 1); on others both are the
// same.
struct Neighbours {
    std::size_t first;
    std::size_t count;
    std::array<double, 4> weights;
};

Neighbours neighbours(bool halved, std::size_t fine)
{
    if (!halved)
        return {fine, 1, {1.0}};
    if (fine % 2 == 0)
        return {fine / 2 + 1, 1, {1.0}};
    return {fine / 2, 4, {-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0}};
}

// Light on the coarse grid, by the transpose of cubic interpolation.
Grid gather(const Grid& fine, const GridLevel& level, const GridLevel& coarser)
{
    Grid coarse(coarser.height, coarser.width);
    constexpr std::size_t margin = 8;  // zeros beside a row: a coarse point takes light from up to 5 texels away
    parallel_for(coarse.height, [&](std::size_t coarse_y) {
        std::vector<double> row(fine.width + 2 * margin);
        const auto add = [&](std::size_t y, double weight) {
            if (y < fine.height)  // false before the first row too, where y wraps around
                add_scaled(row.data() + margin, fine.row(y), weight, fine.width);
        };
        if (level.halves_y) {
            add(2 * coarse_y - 2, 1.0);
            for (const std::size_t y : {2 * coarse_y - 3, 2 * coarse_y - 1})
                add(y, 9.0 / 16.0);
            for (const std::size_t y : {2 * coarse_y - 5, 2 * coarse_y + 1})
                add(y, -1.0 / 16.0);
        } else {
            add(coarse_y, 1.0);
        }
        double* to = coarse.row(coarse_y);
        const double* from = row.data() + margin;
        if (!level.halves_x) {
            std::copy_n(from, coarse.width, to);
            return;
        }
        for (std::size_t x = 0; x < coarse.width; ++x) {
            const double* at = from + 2 * static_cast<std::ptrdiff_t>(x) - 2;
            to[x] = at[0] + 9.0 / 16.0 * (at[-1] + at[1]) - 1.0 / 16.0 * (at[-3] + at[3]);
        }
    });
    return coarse;
}

// Coarse targets from which the fine targets are interpolated.
Targets coarser_targets(const Targets& fine, const GridLevel& level, const GridLevel& coarser)
{
    Targets coarse(coarser.height, coarser.width);
    for (std::size_t y = 0; y < level.height; ++y) {
        const Neighbours across = neighbours(level.halves_y, y);
        for (std::size_t x = 0; x < level.width; ++x) {
            if (!fine.has(y, x))
                continue;
            const Neighbours along = neighbours(level.halves_x, x);
            for (std::size_t k = 0; k < across.count; ++k) {
                coarse.add(across.first + k, along.first);
                coarse.add(across.first + k, along.first + along.count - 1);
            }
        }
    }
    return coarse;
}

void add_interpolated(Grid& fine, const Grid& coarse, const GridLevel& level, const Targets* only)
{
    parallel_for(fine.height, [&](std::size_t y) {
        std::vector<double> row(coarse.width);
        const Neighbours across = neighbours(level.halves_y, y);
        for (std::size_t k = 0; k < across.count; ++k)
            add_scaled(row.data(), coarse.row(across.first + k), across.weights[k], row.size());
        for (std::size_t x = 0; x < fine.width; ++x) {
            if (only != nullptr && !only->has(y, x))
                continue;
            const Neighbours along = neighbours(level.halves_x, x);
            for (std::size_t k = 0; k < along.count; ++k)
                fine.row(y)[x] += along.weights[k] * row[along.first + k];
        }
    });
}

// Non-zero sources of each run of `rows_at_once` rows, from left to right, with a sentinel at the end. The first runs
// begin before the grid.
std::vector<std::vector<LitColumn>> source_rows(const Grid& light)
{
    std::vector<std::vector<LitColumn>> rows(light.height + rows_at_once - 1);
    parallel_for(rows.size(), [&](std::size_t first) {
        for (std::size_t x = 0; x < light.width; ++x) {
            LitColumn source{static_cast<std::ptrdiff_t>(x), {}};
            bool lit = false;
            for (std::size_t i = 0; i < rows_at_once; ++i)
                if (const std::size_t y = first + i + 1 - rows_at_once; y < light.height) {
                    source.light[i] = light.row(y)[x];
                    lit |= source.light[i] != 0.0;
                }
            if (lit)
                rows[first].push_back(source);
        }
        rows[first].push_back({std::numeric_limits<std::ptrdiff_t>::max(), {}});
    });
    return rows;
}

std::size_t term_profile(const LightTerms& terms, std::size_t t)
{
    return terms.terms[t].kernels[0].front().profile;
}

HarmonicSum term_kernel(const LightTerms& terms, std::size_t t)
{
    HarmonicSum sum;
    for (const KernelTerm& part : terms.terms[t].kernels[0])
        (part.phase == Phase::cosine ? sum.cosine : sum.sine)[part.m] += part.weight;
    return sum;
}

}  // namespace

void add_pairs(Grid& sum, const Grid& light, const KernelTable& kernel, Progress& progress, double work,
               const Targets* only)
{
    const std::vector<std::vector<LitColumn>> sources = source_rows(light);
    const auto width = static_cast<std::ptrdiff_t>(sum.width);
    const std::size_t groups = (sum.height + rows_at_once - 1) / rows_at_once;
    parallel_for(groups, [&](std::size_t group) {
        std::array<double*, rows_at_once> rows{};
        std::vector<double> beyond(sum.stride);  // takes the sums of rows beyond the grid
        for (std::size_t i = 0; i < rows_at_once; ++i)
            rows[i] = group * rows_at_once + i < sum.height ? sum.row(group * rows_at_once + i) : beyond.data();
        const auto y = static_cast<std::ptrdiff_t>(group * rows_at_once);
        const auto before = static_cast<std::ptrdiff_t>(rows_at_once) - 1;
        const std::ptrdiff_t first = std::max(-before, y - kernel.reach_y());
        const std::ptrdiff_t end = std::min(static_cast<std::ptrdiff_t>(light.height), y + kernel.reach_y() + 1);
        for (std::ptrdiff_t source_y = first; source_y < end; ++source_y) {
            const LitColumn* source = sources[static_cast<std::size_t>(source_y + before)].data();
            const double* row = kernel.row(y - source_y);
            std::ptrdiff_t reach = kernel.reach_x();
            while (reach > 0 && row[reach] == 0.0 && row[-reach] == 0.0)
                --reach;
            for (std::ptrdiff_t x = 0; x < width; x += targets_at_once) {
                if (only != nullptr && !only->has(group * rows_at_once, static_cast<std::size_t>(x)))
                    continue;
                while (source->x < x - reach)
                    ++source;
                add_sources(rows.data(), x, source, x + targets_at_once - 1 + reach, row);
            }
        }
        progress.advance(work / static_cast<double>(groups));
    });
}

Grid multilevel_sum(const std::vector<GridLevel>& levels, const std::vector<KernelTable>& kernels, Grid light,
                    Progress& progress, double work, const Targets* only)
{
    std::vector<Grid> sums;
    std::vector<Targets> targets;  // [level]; empty for all targets
    for (std::size_t k = 0; k < levels.size(); ++k) {
        if (k > 0)
            light = gather(light, levels[k - 1], levels[k]);
        if (only != nullptr)
            targets.push_back(k == 0 ? *only : coarser_targets(targets.back(), levels[k - 1], levels[k]));
        // The finest grid has nearly all the work.
        add_pairs(sums.emplace_back(light.height, light.width), light, kernels[k], progress, k == 0 ? work : 0.0,
                  only != nullptr ? &targets[k] : nullptr);
    }
    for (std::size_t k = levels.size() - 1; k-- > 0;)
        add_interpolated(sums[k], sums[k + 1], levels[k], only != nullptr ? &targets[k] : nullptr);
    return std::move(sums.front());
}

Grid term_light(const LightTerms& terms, std::size_t t)
{
    Grid grid(terms.plane.height, terms.plane.width);
    parallel_for(grid.height, [&](std::size_t y) {
        TermRow row;
        row.start(terms, {y, 0, grid.width}, t, 1);
        std::copy_n(row.values(), grid.width, grid.row(y));
    });
    return grid;
}

std::vector<KernelIntegrals> kernel_integrals(const LightTerms& terms)
{
    std::vector<KernelIntegrals> integrals;
    for (const auto& known : terms.profiles)
        integrals.emplace_back(known.profile);
    return integrals;
}

Grid TermSums::sum(std::size_t t, Grid light, Progress& progress, double work, const Targets* only)
{
    const std::size_t profile = term_profile(m_terms, t);
    if (!m_kernels.contains(profile))
        m_kernels.emplace(profile, MultilevelKernel(m_integrals[profile], m_levels, m_lit));
    return multilevel_sum(m_levels, m_kernels.at(profile).tables(term_kernel(m_terms, t)), std::move(light), progress,
                          work, only);
}

}  // namespace beamspread
