// What is convolved: the light on the plane, once per function of the direction.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "solve/fft.h"
#include "solve/kernel_spectra.h"
#include "solve/low_rank.h"

namespace beamspread {

// Light that one kernel per medium spreads.
struct LightTerm {
    std::optional<std::size_t> fixed;  // one light as it is; none: all lights of changing direction, times
    std::size_t function = 0;          // this function u(theta) of the basis and cos or sin(m beta)
    Phase phase = Phase::cosine;
    std::vector<std::vector<KernelTerm>> kernels;  // [medium]: sorted, see `KernelSpectra::spectrum`
};

// Lights of one group: those of one direction each have a term with all harmonics, the others share a basis.
struct LightTerms {
    std::vector<LightField> fixed;
    std::vector<LightField> changing;
    LowRankBasis basis;  // of `changing`
    std::vector<LightTerm> terms;
    std::vector<ScaledProfile> profiles;
};

LightTerms light_terms(const std::vector<LightField>& lights, const std::vector<KernelMedium>& media, double texel,
                       double tolerance);

// Values of `count` terms from `first` on for the texels of row y, [term][x] with rows `stride` apart.
void term_rows(const LightTerms& terms, std::size_t first, std::size_t count, std::size_t y, float* values,
               std::size_t stride);

}  // namespace beamspread
