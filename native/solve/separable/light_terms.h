// What is convolved: the light on the plane, once per function of the direction.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "solve/problem/channel_sets.h"
#include "solve/separable/kernel_term.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Light that one kernel per result spreads.
struct LightTerm {
    // The sum of some lights of one direction as they are; empty: of all lights of changing directions a moment, the
    // sum of irradiance, colour in a set, a function u(theta) of the basis, and cos or sin(m beta).
    struct Share {
        std::size_t light;
        float weight;
    };
    std::vector<Share> fixed;
    std::size_t function = 0;
    Phase phase = Phase::cosine;
    std::size_t set = 0;
    std::vector<std::vector<KernelTerm>> kernels;  // [result]: sorted, see `KernelSpectra::parts`; empty: none
};

// Lights of few directions have a term with all harmonics for each; all others add up to moments of one basis, however
// many they are: row by row where the lights are kept, or as they come.
struct LightTerms {
    Plane plane;
    ChannelSets sets;
    std::vector<PlaneLight> fixed;
    std::vector<PlaneLight> changing;
    std::vector<std::vector<float>> colors;  // [changing][set]
    LowRankBasis basis;                      // of `changing`
    std::vector<LightTerm> terms;
    std::vector<ScaledProfile> profiles;
    std::vector<std::vector<float>> moments;  // [term][texel] of light that came; empty: of none, or a fixed term's
};

// The terms of a decomposition that the lights of changing direction need.
using TermChoice =
    std::function<std::vector<std::size_t>(const KernelDecomposition&, const Incidence&, const LightTerms&)>;

// Kernels end where all but the fraction `beyond` of their power lies inside; those of one direction no earlier than for
// a millionth. With light to come, only lights of one direction are kept; the others stand for it in the choice.
LightTerms light_terms(const Problem& problem, double beyond, const TermChoice& choose);

}  // namespace beamspread
