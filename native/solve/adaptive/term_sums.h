// Multilevel sums of the terms of a light.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "base/progress.h"
#include "solve/adaptive/grid.h"
#include "solve/adaptive/multilevel_kernel.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Light of one term on the plane.
Grid term_light(const LightTerms& terms, std::size_t t);

// One kernel per profile is made once.
class TermSums {
public:
    TermSums(const LightTerms& terms, std::vector<GridLevel> levels) : m_terms(terms), m_levels(std::move(levels)) {}

    // Of all targets, or of `only` some.
    Grid sum(std::size_t t, Grid light, Progress& progress, double work, const Targets* only = nullptr);

private:
    const LightTerms& m_terms;
    std::vector<GridLevel> m_levels;
    std::map<std::size_t, MultilevelKernel> m_kernels;
};

}  // namespace beamspread
