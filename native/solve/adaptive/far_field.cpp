#include "solve/adaptive/far_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Below this size a coarser grid, with its margins, saves nothing.
constexpr std::size_t smallest_split = 32;

// Cubic interpolation halfway between points, at -3, -1, 1, 3.
constexpr std::array<double, 4> halfway = {-1.0 / 16.0, 9.0 / 16.0, 9.0 / 16.0, -1.0 / 16.0};

// The same at both ends of an even offset: `halfway` correlated with itself, at -6, -4 ... 6.
constexpr std::array<double, 7> halfway_twice = {1.0 / 256.0,  -18.0 / 256.0, 63.0 / 256.0, 164.0 / 256.0,
                                                 63.0 / 256.0, -18.0 / 256.0, 1.0 / 256.0};

// Point j of the coarser grid is point 2 (j - 1) of the finer one: one before its first, one or two after its last.
std::size_t coarse_size(std::size_t size)
{
    return size / 2 + 3;
}

// Offsets that a level's kernel must reach to, so that every level above finds its own.
std::ptrdiff_t reach_for(std::size_t size)
{
    if (size < smallest_split)
        return static_cast<std::ptrdiff_t>(size) - 1;
    const std::size_t coarse = coarse_size(size);
    return 2 * std::max(static_cast<std::ptrdiff_t>(coarse), reach_for(coarse));
}

// Weights of the coarse offsets first, first + 1 ... in a kernel interpolated at both ends, for a source at an even or
// odd point and a target `offset` points away.
struct Taps {
    std::ptrdiff_t first = 0;
    std::size_t count = 1;
    std::array<double, 7> weights{1.0};

    Taps(bool split, bool odd_source, std::ptrdiff_t offset)
    {
        if (!split) {
            first = offset;
        } else if (offset % 2 != 0) {
            first = (offset - 3) / 2;
            count = halfway.size();
            std::copy(halfway.begin(), halfway.end(), weights.begin());
        } else if (odd_source) {
            first = offset / 2 - 3;
            count = halfway_twice.size();
            weights = halfway_twice;
        } else {
            first = offset / 2;
        }
    }
};

// Spreads a light over the points that its place would be interpolated from: P^T, along rows.
Grid gather_columns(const Grid& fine)
{
    Grid coarse(fine.height, coarse_size(fine.width));
    for (std::size_t y = 0; y < fine.height; ++y) {
        const double* from = fine.row(y);
        double* to = coarse.row(y);
        for (std::size_t x = 0; x < fine.width; ++x) {
            if (x % 2 == 0)
                to[x / 2 + 1] += from[x];
            else
                for (std::size_t k = 0; k < halfway.size(); ++k)
                    to[x / 2 + k] += halfway[k] * from[x];
        }
    }
    return coarse;
}

Grid gather_rows(const Grid& fine)
{
    Grid coarse(coarse_size(fine.height), fine.width);
    for (std::size_t y = 0; y < fine.height; ++y) {
        if (y % 2 == 0)
            add_scaled(coarse.row(y / 2 + 1), fine.row(y), 1.0, fine.width);
        else
            for (std::size_t k = 0; k < halfway.size(); ++k)
                add_scaled(coarse.row(y / 2 + k), fine.row(y), halfway[k], fine.width);
    }
    return coarse;
}

// Interpolates: P, along rows and along columns.
Grid interpolate_columns(const Grid& coarse, std::size_t width)
{
    Grid fine(coarse.height, width);
    for (std::size_t y = 0; y < fine.height; ++y) {
        const double* from = coarse.row(y);
        double* to = fine.row(y);
        for (std::size_t x = 0; x < width; ++x) {
            if (x % 2 == 0)
                to[x] = from[x / 2 + 1];
            else
                for (std::size_t k = 0; k < halfway.size(); ++k)
                    to[x] += halfway[k] * from[x / 2 + k];
        }
    }
    return fine;
}

Grid interpolate_rows(const Grid& coarse, std::size_t height)
{
    Grid fine(height, coarse.width);
    for (std::size_t y = 0; y < height; ++y) {
        if (y % 2 == 0)
            add_scaled(fine.row(y), coarse.row(y / 2 + 1), 1.0, fine.width);
        else
            for (std::size_t k = 0; k < halfway.size(); ++k)
                add_scaled(fine.row(y), coarse.row(y / 2 + k), halfway[k], fine.width);
    }
    return fine;
}

// Every other value along the split axes.
KernelTable coarser(const KernelTable& kernel, bool split_y, bool split_x)
{
    const std::ptrdiff_t step_y = split_y ? 2 : 1;
    const std::ptrdiff_t step_x = split_x ? 2 : 1;
    KernelTable coarse(kernel.reach_y() / step_y, kernel.reach_x() / step_x);
    parallel_for(static_cast<std::size_t>(2 * coarse.reach_y() + 1), [&](std::size_t i) {
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - coarse.reach_y();
        for (std::ptrdiff_t dx = -coarse.reach_x(); dx <= coarse.reach_x(); ++dx)
            coarse.row(dy)[dx] = kernel.row(step_y * dy)[step_x * dx];
    });
    return coarse;
}

// R(d) = K(d) - (P K_coarse P^T)(d), which depends on whether the source is at an even or odd row and column.
class Remainder {
public:
    Remainder(const KernelTable& kernel, const KernelTable& coarse, std::size_t width, bool split_y, bool split_x)
        : m_kernel(kernel), m_split_y(split_y), m_split_x(split_x), m_reach_x(static_cast<std::ptrdiff_t>(width) - 1)
    {
        for (std::size_t odd = 0; odd < (split_x ? 2 : 1); ++odd) {
            KernelTable table(coarse.reach_y(), m_reach_x);
            parallel_for(static_cast<std::size_t>(2 * coarse.reach_y() + 1), [&](std::size_t i) {
                const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - coarse.reach_y();
                interpolate(coarse.row(dy), odd == 1, table.row(dy));
            });
            m_interpolated.push_back(std::move(table));
        }
    }

    // The row of offsets dx = -count .. count for a source at an odd or even row and column.
    void row(bool odd_y, bool odd_x, std::ptrdiff_t dy, std::ptrdiff_t count, double* values) const
    {
        const auto length = static_cast<std::size_t>(2 * count + 1);
        std::copy_n(m_kernel.row(dy) - count, length, values);
        const Taps taps(m_split_y, odd_y, dy);
        for (std::size_t k = 0; k < taps.count; ++k)
            add_scaled(values, m_interpolated[odd_x].row(taps.first + static_cast<std::ptrdiff_t>(k)) - count,
                       -taps.weights[k], length);
    }

    bool depends_on_row() const { return m_split_y; }
    bool depends_on_column() const { return m_split_x; }

private:
    void interpolate(const double* from, bool odd, double* to) const
    {
        const Taps at_even(m_split_x, odd, 0);
        const Taps at_odd(m_split_x, odd, 1);
        for (std::ptrdiff_t dx = -m_reach_x; dx <= m_reach_x; ++dx) {
            if (!m_split_x) {
                to[dx] = from[dx];
                continue;
            }
            const bool is_odd = dx % 2 != 0;
            const Taps& taps = is_odd ? at_odd : at_even;
            const double* first = from + taps.first + (dx - (is_odd ? 1 : 0)) / 2;
            double sum = 0.0;
            for (std::size_t k = 0; k < taps.count; ++k)
                sum += taps.weights[k] * first[k];
            to[dx] = sum;
        }
    }

    const KernelTable& m_kernel;
    bool m_split_y;
    bool m_split_x;
    std::ptrdiff_t m_reach_x;
    std::vector<KernelTable> m_interpolated;  // along rows only, per parity of the source's column
};

// Sums of absolute values by distance from the source, in whole texels.
class DistanceSums {
public:
    DistanceSums(std::size_t height, std::size_t width)
        : m_reach_y(static_cast<std::ptrdiff_t>(height) - 1), m_reach_x(static_cast<std::ptrdiff_t>(width) - 1)
    {
        const double farthest = std::hypot(static_cast<double>(m_reach_y), static_cast<double>(m_reach_x));
        m_sums.assign(static_cast<std::size_t>(farthest) + 2, 0.0);
    }

    // fill(dy, values) writes absolute values for dx = -reach_x .. reach_x.
    template <class Fill>
    void add_rows(const Fill& fill)
    {
        const auto rows = static_cast<std::size_t>(2 * m_reach_y + 1);
        constexpr std::size_t rows_per_block = 16;
        const std::size_t blocks = (rows + rows_per_block - 1) / rows_per_block;
        std::vector<std::vector<double>> sums(blocks);
        parallel_for(blocks, [&](std::size_t block) {
            sums[block].assign(m_sums.size(), 0.0);
            std::vector<double> values(static_cast<std::size_t>(2 * m_reach_x + 1));
            for (std::size_t i = block * rows_per_block; i < std::min(rows, (block + 1) * rows_per_block); ++i) {
                const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - m_reach_y;
                fill(dy, values.data());
                for (std::size_t j = 0; j < values.size(); ++j) {
                    const std::ptrdiff_t dx = static_cast<std::ptrdiff_t>(j) - m_reach_x;
                    const auto distance = std::sqrt(static_cast<double>(dx * dx + dy * dy));
                    sums[block][static_cast<std::size_t>(distance)] += values[j];
                }
            }
        });
        for (const std::vector<double>& part : sums)
            add_scaled(m_sums.data(), part.data(), 1.0, part.size());
    }

    // The smallest radius beyond which not more than `allowed` is left.
    std::ptrdiff_t radius(double allowed) const
    {
        double left = 0.0;
        auto distance = static_cast<std::ptrdiff_t>(m_sums.size());
        while (distance > 0 && left + m_sums[static_cast<std::size_t>(distance - 1)] <= allowed)
            left += m_sums[static_cast<std::size_t>(--distance)];
        return distance;
    }

    std::ptrdiff_t reach_x() const { return m_reach_x; }

private:
    std::ptrdiff_t m_reach_y;
    std::ptrdiff_t m_reach_x;
    std::vector<double> m_sums;
};

// The part of a kernel that add_near needs.
template <class Row>
KernelTable near_part(const Row& row, std::ptrdiff_t radius, std::size_t height, std::size_t width)
{
    const std::ptrdiff_t reach_y = std::min(radius, static_cast<std::ptrdiff_t>(height) - 1);
    const std::ptrdiff_t reach_x = std::min(radius, static_cast<std::ptrdiff_t>(width) - 1);
    KernelTable table(reach_y, reach_x + near_block);
    for (std::ptrdiff_t dy = -reach_y; dy <= reach_y; ++dy)
        row(dy, reach_x, table.row(dy) - reach_x);
    return table;
}

std::size_t count_lit(const Grid& light)
{
    return static_cast<std::size_t>(
        std::count_if(light.values.begin(), light.values.end(), [](double value) { return value != 0.0; }));
}

// Shares of all light in rows and columns of each parity.
std::vector<double> shares_of_light(const Grid& light, std::size_t odd_rows, std::size_t odd_columns)
{
    std::vector<double> shares(odd_rows * odd_columns, 0.0);
    for (std::size_t y = 0; y < light.height; ++y)
        for (std::size_t x = 0; x < light.width; ++x)
            shares[(y % odd_rows) * odd_columns + x % odd_columns] += std::abs(light.row(y)[x]);
    const double all = std::accumulate(shares.begin(), shares.end(), 0.0);
    for (double& share : shares)
        share /= all;
    return shares;
}

}  // namespace

double absolute_sum(const Grid& grid)
{
    double sum = 0.0;
    for (const double value : grid.values)
        sum += std::abs(value);
    return sum;
}

FarField::FarField(std::size_t height, std::size_t width) : m_reach_y(reach_for(height)), m_reach_x(reach_for(width))
{
    // Interpolation with weights of both signs makes the sum of absolute errors larger, by at most this per axis
    // however often it is repeated: the integral of the absolute value of the cubic fundamental function.
    constexpr double growth = 1.25;
    double cell = 1.0;
    while (true) {
        Level level{Grid(height, width), height >= smallest_split, width >= smallest_split, cell};
        cell *= (level.split_y ? 2.0 : 1.0) * (level.split_x ? 2.0 : 1.0);
        if (m_levels.empty())
            cell *= (level.split_y ? growth : 1.0) * (level.split_x ? growth : 1.0);
        height = level.split_y ? coarse_size(height) : height;
        width = level.split_x ? coarse_size(width) : width;
        const bool last = !level.split_y && !level.split_x;
        m_levels.push_back(std::move(level));
        if (last)
            return;
    }
}

void FarField::add(const KernelTable& kernel, Grid light, double allowed_error)
{
    const KernelTable* current = &kernel;
    KernelTable coarse;
    KernelTable next;
    for (Level& level : m_levels) {
        const auto lit = static_cast<double>(count_lit(light));
        if (lit == 0.0)
            return;
        const std::size_t height = light.height;
        const std::size_t width = light.width;
        // Half of what is left to each level: the finest ones cost most.
        allowed_error *= 0.5;
        const double allowed = allowed_error / (level.cell * absolute_sum(light));

        DistanceSums kernel_sums(height, width);
        kernel_sums.add_rows([&](std::ptrdiff_t dy, double* values) {
            for (std::ptrdiff_t dx = -kernel_sums.reach_x(); dx <= kernel_sums.reach_x(); ++dx)
                *values++ = std::abs(current->row(dy)[dx]);
        });
        const std::ptrdiff_t kernel_radius = kernel_sums.radius(allowed);
        const double kernel_cost = lit * near_cost(kernel_radius, height, width);
        const auto add_kernel = [&] {
            const KernelTable table =
                near_part([&](std::ptrdiff_t dy, std::ptrdiff_t reach,
                              double* values) { std::copy_n(current->row(dy) - reach, 2 * reach + 1, values); },
                          kernel_radius, height, width);
            add_near(level.sum, light, {kernel_radius, {&table, &table, &table, &table}});
        };

        // Finding the remainder costs about this much per value of the kernel.
        constexpr double remainder_cost = 40.0;
        const bool last = !level.split_y && !level.split_x;
        if (last || kernel_cost < remainder_cost * static_cast<double>(current->size())) {
            add_kernel();
            return;
        }

        next = coarser(*current, level.split_y, level.split_x);
        const Remainder remainder(*current, next, width, level.split_y, level.split_x);
        const std::size_t odd_rows = level.split_y ? 2 : 1;
        const std::size_t odd_columns = level.split_x ? 2 : 1;
        const std::vector<double> shares = shares_of_light(light, odd_rows, odd_columns);
        DistanceSums remainder_sums(height, width);
        remainder_sums.add_rows([&](std::ptrdiff_t dy, double* values) {
            const std::ptrdiff_t reach = remainder_sums.reach_x();
            const auto length = static_cast<std::size_t>(2 * reach + 1);
            std::vector<double> row(length);
            std::fill_n(values, length, 0.0);
            for (std::size_t parity = 0; parity < shares.size(); ++parity) {
                if (shares[parity] == 0.0)
                    continue;
                remainder.row(parity / odd_columns == 1, parity % odd_columns == 1, dy, reach, row.data());
                for (std::size_t k = 0; k < length; ++k)
                    values[k] += shares[parity] * std::abs(row[k]);
            }
        });
        const std::ptrdiff_t radius = remainder_sums.radius(allowed);
        // The coarser levels together: each light becomes up to four, and a third as many as there are texels.
        const double coarse_lit = std::min(4.0 * lit, static_cast<double>(height * width) / 3.0);
        if ((lit + coarse_lit) * near_cost(radius, height, width) > kernel_cost) {
            add_kernel();
            return;
        }
        std::vector<KernelTable> tables;
        for (std::size_t parity = 0; parity < odd_rows * odd_columns; ++parity)
            tables.push_back(near_part(
                [&](std::ptrdiff_t dy, std::ptrdiff_t reach, double* values) {
                    remainder.row(parity / odd_columns == 1, parity % odd_columns == 1, dy, reach, values);
                },
                radius, height, width));
        NearKernels kernels{radius, {}};
        for (std::size_t parity = 0; parity < kernels.tables.size(); ++parity)
            kernels.tables[parity] = &tables[(parity / 2 % odd_rows) * odd_columns + parity % odd_columns];
        add_near(level.sum, light, kernels);

        if (level.split_x)
            light = gather_columns(light);
        if (level.split_y)
            light = gather_rows(light);
        coarse = std::move(next);
        current = &coarse;
    }
}

Grid FarField::sum() const
{
    Grid total = m_levels.back().sum;
    for (std::size_t i = m_levels.size() - 1; i-- > 0;) {
        const Level& level = m_levels[i];
        if (level.split_y)
            total = interpolate_rows(total, level.sum.height);
        if (level.split_x)
            total = interpolate_columns(total, level.sum.width);
        add_scaled(total.values.data(), level.sum.values.data(), 1.0, total.values.size());
    }
    return total;
}

}  // namespace beamspread
