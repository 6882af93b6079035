// What is convolved: the light on the plane, once per function of the direction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "solve/separable/kernel_term.h"
#include "solve/separable/light_pyramid.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Light that one kernel per medium spreads.
struct LightTerm {
    std::optional<std::size_t> fixed;  // one light as it is; none: all lights of changing direction, times
    std::size_t function = 0;          // this function u(theta) of the basis and cos or sin(m beta)
    Phase phase = Phase::cosine;
    std::vector<std::vector<KernelTerm>> kernels;  // [medium]: sorted, see `KernelSpectra::parts`
};

// Lights of one group: those of one direction each have a term with all harmonics, the others share a basis.
struct LightTerms {
    std::vector<LightField> fixed;
    std::vector<LightField> changing;
    LowRankBasis basis;  // of `changing`
    std::vector<LightTerm> terms;
    std::vector<ScaledProfile> profiles;
};

// The terms of a decomposition that the lights of changing direction need.
using TermChoice =
    std::function<std::vector<std::size_t>(const KernelDecomposition&, const std::vector<LightPyramid>&)>;

// `texel`: its side in metres. Kernels end where all but the fraction `beyond` of their power lies inside; those of one
// direction no earlier than for a millionth.
LightTerms light_terms(const std::vector<LightField>& lights, const std::vector<KernelMedium>& media, double texel,
                       double beyond, const TermChoice& choose);

// Part of a row of texels.
struct RowSpan {
    std::size_t y;
    std::size_t x;
    std::size_t width;
};

// The light of one row, from term to term in their order: what all terms of changing direction share is found once.
class TermRow {
public:
    void start(const LightTerms& terms, const RowSpan& span);

    // Values of term t; t may not go down.
    void evaluate(const LightTerms& terms, std::size_t t, float* values);

private:
    struct Light {
        std::vector<std::uint32_t> step;  // in the tables of the basis
        std::vector<float> part;
        std::vector<float> cos_beta;
        std::vector<float> sin_beta;
        std::vector<float> cosine;  // cos(m beta), sin(m beta) times irradiance
        std::vector<float> sine;
        std::vector<float> u;
        std::optional<std::size_t> function;  // that u holds
        std::size_t m = 0;
    };
    RowSpan m_span{};
    std::vector<Light> m_lights;  // of changing direction
};

}  // namespace beamspread
