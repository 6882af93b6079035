#include "solve/adaptive/term_sums.h"

#include <algorithm>

#include "base/threads.h"
#include "solve/adaptive/multilevel_sum.h"
#include "solve/separable/term_row.h"

namespace beamspread {

namespace {

std::size_t term_profile(const LightTerms& terms, std::size_t t)
{
    return terms.terms[t].kernels[0].front().profile;
}

HarmonicSum term_kernel(const LightTerms& terms, std::size_t t)
{
    HarmonicSum sum;
    for (const KernelTerm& part : terms.terms[t].kernels[0])
        (part.phase == Phase::cosine ? sum.cosine : sum.sine)[part.m] += part.weight;
    return sum;
}

}  // namespace

Grid term_light(const LightTerms& terms, std::size_t t)
{
    Grid grid(terms.plane.height, terms.plane.width);
    parallel_for(grid.height, [&](std::size_t y) {
        TermRow row;
        row.start(terms, {y, 0, grid.width}, t, 1);
        std::copy_n(row.values(t), grid.width, grid.row(y));
    });
    return grid;
}

Grid TermSums::sum(std::size_t t, Grid light, Progress& progress, double work, const Targets* only)
{
    const std::size_t profile = term_profile(m_terms, t);
    if (!m_kernels.contains(profile))
        m_kernels.emplace(profile, MultilevelKernel(m_terms.profiles[profile].profile, m_levels));
    return multilevel_sum(m_levels, m_kernels.at(profile).tables(term_kernel(m_terms, t)), std::move(light), progress,
                          work, only);
}

}  // namespace beamspread
