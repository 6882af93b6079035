#include "solve/adaptive/multilevel_sum.h"

#include <algorithm>
#include <array>
#include <limits>

#include "base/platform.h"
#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Coarse points first .. first + count - 1 that a fine point lies between, and their weights in cubic interpolation.
// Where an axis is halved, coarse point j is fine point 2 (j - 1); otherwise they are the same.
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

// Hands light to the coarse points that its place is interpolated from.
Grid gather(const Grid& fine, const GridLevel& level, const GridLevel& coarser)
{
    Grid coarse(coarser.height, coarser.width);
    std::vector<double> row(coarse.width);
    for (std::size_t y = 0; y < fine.height; ++y) {
        std::fill(row.begin(), row.end(), 0.0);
        for (std::size_t x = 0; x < fine.width; ++x) {
            const Neighbours along = neighbours(level.halves_x, x);
            for (std::size_t k = 0; k < along.count; ++k)
                row[along.first + k] += along.weights[k] * fine.row(y)[x];
        }
        const Neighbours across = neighbours(level.halves_y, y);
        for (std::size_t k = 0; k < across.count; ++k)
            add_scaled(coarse.row(across.first + k), row.data(), across.weights[k], row.size());
    }
    return coarse;
}

void add_interpolated(Grid& fine, const Grid& coarse, const GridLevel& level)
{
    parallel_for(fine.height, [&](std::size_t y) {
        std::vector<double> row(coarse.width);
        const Neighbours across = neighbours(level.halves_y, y);
        for (std::size_t k = 0; k < across.count; ++k)
            add_scaled(row.data(), coarse.row(across.first + k), across.weights[k], row.size());
        for (std::size_t x = 0; x < fine.width; ++x) {
            const Neighbours along = neighbours(level.halves_x, x);
            for (std::size_t k = 0; k < along.count; ++k)
                fine.row(y)[x] += along.weights[k] * row[along.first + k];
        }
    });
}

struct Source {
    std::ptrdiff_t x;
    double light;
};

// Sources other than zero of each row, from left to right, and one that is never reached.
std::vector<std::vector<Source>> source_rows(const Grid& light)
{
    std::vector<std::vector<Source>> rows(light.height);
    for (std::size_t y = 0; y < light.height; ++y) {
        for (std::size_t x = 0; x < light.width; ++x)
            if (light.row(y)[x] != 0.0)
                rows[y].push_back({static_cast<std::ptrdiff_t>(x), light.row(y)[x]});
        rows[y].push_back({std::numeric_limits<std::ptrdiff_t>::max(), 0.0});
    }
    return rows;
}

using Lanes = double __attribute__((vector_size(64), aligned(8), may_alias));
static_assert(2 * sizeof(Lanes) == targets_at_once * sizeof(double));

// Adds the sources of one row up to column `last` to the targets from column x on; the kernel's row at dx = 0.
BEAMSPREAD_CLONES void add_sources(double* sum, std::ptrdiff_t x, const Source* source, std::ptrdiff_t last,
                                   const double* kernel)
{
    auto* to = reinterpret_cast<Lanes*>(sum);
    Lanes left = to[0];
    Lanes right = to[1];
    for (; source->x <= last; ++source) {
        const auto* values = reinterpret_cast<const Lanes*>(kernel + (x - source->x));
        left += source->light * values[0];
        right += source->light * values[1];
    }
    to[0] = left;
    to[1] = right;
}

}  // namespace

void add_pairs(Grid& sum, const Grid& light, const KernelTable& kernel, Progress& progress, double work)
{
    const std::vector<std::vector<Source>> sources = source_rows(light);
    const auto width = static_cast<std::ptrdiff_t>(sum.width);
    parallel_for(sum.height, [&](std::size_t target) {
        const auto y = static_cast<std::ptrdiff_t>(target);
        const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, y - kernel.reach_y());
        const std::ptrdiff_t end = std::min(static_cast<std::ptrdiff_t>(light.height), y + kernel.reach_y() + 1);
        for (std::ptrdiff_t source_y = first; source_y < end; ++source_y) {
            const Source* source = sources[static_cast<std::size_t>(source_y)].data();
            const double* row = kernel.row(y - source_y);
            std::ptrdiff_t reach = kernel.reach_x();
            while (reach > 0 && row[reach] == 0.0 && row[-reach] == 0.0)
                --reach;
            for (std::ptrdiff_t x = 0; x < width; x += targets_at_once) {
                while (source->x < x - reach)
                    ++source;
                add_sources(sum.row(target) + x, x, source, x + targets_at_once - 1 + reach, row);
            }
        }
        progress.advance(work / static_cast<double>(sum.height));
    });
}

Grid multilevel_sum(const std::vector<GridLevel>& levels, const std::vector<KernelTable>& kernels, Grid light,
                    Progress& progress, double work)
{
    std::vector<Grid> sums;
    for (std::size_t k = 0; k < levels.size(); ++k) {
        if (k > 0)
            light = gather(light, levels[k - 1], levels[k]);
        // Nearly all the work is on the finest grid.
        add_pairs(sums.emplace_back(light.height, light.width), light, kernels[k], progress, k == 0 ? work : 0.0);
    }
    for (std::size_t k = levels.size() - 1; k-- > 0;)
        add_interpolated(sums[k], sums[k + 1], levels[k]);
    return std::move(sums.front());
}

}  // namespace beamspread
