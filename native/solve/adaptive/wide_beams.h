// Light of squares as beams of their width (Manabe et al. 2012, section 3.3).
#pragma once

#include <vector>

#include "solve/adaptive/even_squares.h"
#include "solve/adaptive/grid.h"

namespace beamspread {

// Light in squares, as steps at their corners: a square is the sum of four steps, each lit without end above and to the
// right of a corner. Where squares of the same light meet, their steps cancel. The light moves out of `light`.
Grid take_steps(Grid& light, const std::vector<Square>& squares);

// The luminance of a step: a kernel's sums over all offsets below and to the left, for offsets from a corner.
KernelTable step_kernel(const Grid& kernel);

}  // namespace beamspread
