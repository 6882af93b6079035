#include "solve/adaptive/wide_beams.h"

#include <algorithm>

namespace beamspread {

Grid take_steps(Grid& light, const std::vector<Square>& squares)
{
    Grid steps(light.height + 1, light.width + 1);
    for (const Square& square : squares) {
        // Around the first texel, so that even light has exactly its own value as mean.
        const double first = light.row(square.y)[square.x];
        double sum = 0.0;
        for (std::size_t y = square.y; y < square.y + square.size; ++y) {
            for (std::size_t x = square.x; x < square.x + square.size; ++x)
                sum += light.row(y)[x] - first;
            std::fill_n(light.row(y) + square.x, square.size, 0.0);
        }
        const double mean = first + sum / static_cast<double>(square.size * square.size);
        steps.row(square.y)[square.x] += mean;
        steps.row(square.y)[square.x + square.size] -= mean;
        steps.row(square.y + square.size)[square.x] -= mean;
        steps.row(square.y + square.size)[square.x + square.size] += mean;
    }
    return steps;
}

KernelTable step_kernel(const Grid& kernel)
{
    KernelTable sums((kernel.height + 1) / 2, (kernel.width + 1) / 2);
    for (std::size_t y = 0; y < kernel.height; ++y) {
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(y) + 1 - sums.reach_y();
        const double* below = sums.row(dy - 1) + 1 - sums.reach_x();
        double* row = sums.row(dy) + 1 - sums.reach_x();
        double row_sum = 0.0;
        for (std::size_t x = 0; x < kernel.width; ++x) {
            row_sum += kernel.row(y)[x];
            row[x] = row_sum + below[x];
        }
    }
    return sums;
}

}  // namespace beamspread
