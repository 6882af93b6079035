// Light that a kernel spreads over a plane, seen the more coarsely the farther away it is.
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/adaptive/grid.h"
#include "solve/adaptive/multilevel_kernel.h"

namespace beamspread {

// sum(target) += kernel(target - source) * light(source) for every pair that the table has an offset for; `only` for some
// targets. Advances the progress by `work`, row by row.
void add_pairs(Grid& sum, const Grid& light, const KernelTable& kernel, Progress& progress, double work,
               const Targets* only = nullptr);

// The same for a kernel as a sum over levels, of light on the finest: each level's light and sums are interpolated by
// cubics from the next coarser one's.
Grid multilevel_sum(const std::vector<GridLevel>& levels, const std::vector<KernelTable>& kernels, Grid light,
                    Progress& progress, double work, const Targets* only = nullptr);

}  // namespace beamspread
