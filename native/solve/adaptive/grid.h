// Values on grids, and kernels as tables of offsets.
#pragma once

#include <cstddef>
#include <vector>

#include "simd/loops.h"

namespace beamspread {

// Columns and rows of targets that are summed together, with their sums in registers.
inline constexpr std::ptrdiff_t targets_at_once = target_columns;
inline constexpr std::size_t rows_at_once = target_rows;

// Values on a grid, row by row. Zeros pad rows to a multiple of `targets_at_once`.
struct Grid {
    std::size_t height;
    std::size_t width;
    std::size_t stride;
    std::vector<double> values;

    Grid(std::size_t grid_height, std::size_t grid_width)
        : height(grid_height),
          width(grid_width),
          stride((width + targets_at_once - 1) / targets_at_once * targets_at_once),
          values(height * stride)
    {
    }
    double* row(std::size_t y) { return values.data() + y * stride; }
    const double* row(std::size_t y) const { return values.data() + y * stride; }
};

// Some targets of a grid, in whole blocks of rows_at_once x targets_at_once.
class Targets {
public:
    Targets(std::size_t height, std::size_t width)
        : m_blocks(width / targets_at_once + 1), m_has((height / rows_at_once + 1) * m_blocks)
    {
    }

    void add(std::size_t y, std::size_t x) { m_has[block(y, x)] = 1; }
    bool has(std::size_t y, std::size_t x) const { return m_has[block(y, x)] != 0; }

private:
    std::size_t block(std::size_t y, std::size_t x) const { return y / rows_at_once * m_blocks + x / targets_at_once; }

    std::size_t m_blocks;
    std::vector<char> m_has;
};

// Values of a kernel for offsets -reach .. reach from a beam, rows upward. Zeros on both sides of a row serve targets
// beyond.
class KernelTable {
public:
    KernelTable(std::size_t reach_y, std::size_t reach_x)
        : m_reach_y(static_cast<std::ptrdiff_t>(reach_y)),
          m_reach_x(static_cast<std::ptrdiff_t>(reach_x)),
          m_values((2 * reach_y + 1) * static_cast<std::size_t>(stride()))
    {
    }

    std::ptrdiff_t reach_y() const { return m_reach_y; }
    std::ptrdiff_t reach_x() const { return m_reach_x; }

    // Pointer to the value at dx = 0; dx may be negative.
    double* row(std::ptrdiff_t dy) { return m_values.data() + (dy + m_reach_y) * stride() + stride() / 2; }
    const double* row(std::ptrdiff_t dy) const { return m_values.data() + (dy + m_reach_y) * stride() + stride() / 2; }

private:
    std::ptrdiff_t stride() const { return 2 * (m_reach_x + targets_at_once) + 1; }

    std::ptrdiff_t m_reach_y;
    std::ptrdiff_t m_reach_x;
    std::vector<double> m_values;
};

}  // namespace beamspread
