// Lights that are added pair by pair: the innermost loops of the adaptive solver.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "solve/adaptive/texel_kernel.h"

namespace beamspread {

// Values on a grid, row by row.
struct Grid {
    std::size_t height = 0;
    std::size_t width = 0;
    std::vector<double> values;

    Grid() = default;
    Grid(std::size_t grid_height, std::size_t grid_width)
        : height(grid_height), width(grid_width), values(grid_height * grid_width)
    {
    }
    double* row(std::size_t y) { return values.data() + y * width; }
    const double* row(std::size_t y) const { return values.data() + y * width; }
};

// The kernels of lights at even and odd rows and columns, [2 * (row % 2) + column % 2]; the same one where the
// parity does not matter. Beyond `radius` nothing is needed of them; they are zero or more exact than needed there.
struct NearKernels {
    std::ptrdiff_t radius = 0;
    std::array<const KernelTable*, 4> tables{};
};

// Targets that are summed at a time: a kernel's rows must reach this much farther than the radius and the grid.
inline constexpr std::ptrdiff_t near_block = 16;

// sum(target) += kernel(target - light) * light for every pair that is no farther apart than the radius.
void add_near(Grid& sum, const Grid& lights, const NearKernels& kernels);

// Multiplications and additions that add_near costs for one light.
double near_cost(std::ptrdiff_t radius, std::size_t height, std::size_t width);

}  // namespace beamspread
