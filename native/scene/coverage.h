// Coverage of texels by polygons.
#pragma once

#include <cstdint>
#include <span>

#include "base/vec.h"
#include "base/view.h"

namespace beamspread {

struct CoverageOptions {
    std::size_t row_step =
        1;  // 2 and more: row i of the grid is one of the texel rows i * row_step to (i + 1) * row_step - 1
    bool is_cut = true;        // sums of overlapping polygons are cut at 1
    int threads = 0;
};

// Writes the exact part, 0 to 1, of each texel inside the polygons. `corners` holds the corners of all polygons, one after
// the other, in texels: texel (x, y) spans [x, x + 1] x [y, y + 1]. `corner_counts` holds the number of corners of each
// polygon. Polygons may be concave, have either orientation and reach beyond the grid. Throws InvalidArgument.
void compute_coverage(std::span<const Vec2> corners, std::span<const std::uint32_t> corner_counts,
                      const CoverageOptions& options, const View2D<float>& coverage);

}  // namespace beamspread
