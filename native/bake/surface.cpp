#include "bake/surface.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

Surface Surface::coarse(double share, std::size_t side, std::size_t min_side) const
{
    side = std::clamp(static_cast<std::size_t>(std::sqrt(share) * static_cast<double>(side)), min_side, side);
    Surface few{.grid = grid, .clearance = clearance};
    few.grid.width = std::min(grid.width, side);
    few.grid.height = std::min(grid.height, side);
    few.grid.pitch_x *= static_cast<double>(grid.width) / static_cast<double>(few.grid.width);
    few.grid.pitch_y *= static_cast<double>(grid.height) / static_cast<double>(few.grid.height);
    return few;
}

}  // namespace beamspread
