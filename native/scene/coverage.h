// Coverage of texels by polygons.
#pragma once

#include <cstdint>
#include <span>

#include "base/vec.h"
#include "base/view.h"

namespace beamspread {

// Writes the exact part, 0 to 1, of each texel inside the polygons. `corners` holds the corners of all polygons, one after
// the other, in texels: texel (x, y) spans [x, x + 1] x [y, y + 1]. `corner_counts` holds the number of corners of each
// polygon. Polygons may be concave, have either orientation and reach beyond the grid; sums of overlapping ones are cut at
// 1. Throws InvalidArgument.
void compute_coverage(std::span<const Vec2> corners, std::span<const std::uint32_t> corner_counts, int threads,
                      const View2D<float>& coverage);

}  // namespace beamspread
