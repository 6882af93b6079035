// Multilevel sums: light that kernels spread over a plane, on coarser grids at larger distances.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "base/progress.h"
#include "solve/adaptive/grid.h"
#include "solve/adaptive/multilevel_kernel.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Adds kernel(target - source) * light(source) to sum(target) for every pair within the table's offsets, for all
// targets or `only` some. Advances the progress by `work`, row by row.
void add_pairs(Grid& sum, const Grid& light, const KernelTable& kernel, Progress& progress, double work,
               const Targets* only = nullptr);

// The sum for a kernel on several levels, of light on the finest. Cubic interpolation takes light to each coarser grid
// and sums back.
Grid multilevel_sum(const std::vector<GridLevel>& levels, const std::vector<KernelTable>& kernels, Grid light,
                    Progress& progress, double work, const Targets* only = nullptr);

// Light of one term on the plane.
Grid term_light(const LightTerms& terms, std::size_t t);

// Multilevel sums of terms. Caches the kernel of each profile.
class TermSums {
public:
    TermSums(const LightTerms& terms, std::vector<GridLevel> levels) : m_terms(terms), m_levels(std::move(levels)) {}

    // Sum of term t, for all targets or `only` some.
    Grid sum(std::size_t t, Grid light, Progress& progress, double work, const Targets* only = nullptr);

private:
    const LightTerms& m_terms;
    std::vector<GridLevel> m_levels;
    std::map<std::size_t, MultilevelKernel> m_kernels;
};

}  // namespace beamspread
