// Terms of a plane's light: for each function of the direction, light that one kernel spreads.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "solve/problem/channel_sets.h"
#include "solve/separable/kernel_term.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Light that one kernel per result spreads: the weighted sum of some lights of one direction; or a moment of all lights
// of changing directions, the sum of irradiance times colour in a set times u(theta) times cos or sin(m beta).
struct LightTerm {
    struct Share {
        std::size_t light;
        float weight;
    };
    std::vector<Share> fixed;  // empty for a moment
    std::size_t function = 0;
    Phase phase = Phase::cosine;
    std::size_t set = 0;
    std::vector<std::vector<KernelTerm>> kernels;  // [result], sorted, see `KernelSpectra::parts`; empty: none
};

// All terms. Lights of few directions have one term per direction, with all harmonics. All other lights, of any number,
// add up to the moments of one basis: row by row from stored lights, or as they come.
struct LightTerms {
    Plane plane;
    ChannelSets sets;
    std::vector<PlaneLight> fixed;
    std::vector<PlaneLight> changing;
    std::vector<std::vector<float>> colors;  // [changing][set]
    LowRankBasis basis;                      // of `changing`
    std::vector<LightTerm> terms;
    std::vector<ScaledProfile> profiles;
    std::vector<std::vector<float>> moments;  // [term][texel] of added light; empty for fixed terms and without it
};

// Chooses the terms of a decomposition that lights of changing directions need.
using TermChoice =
    std::function<std::vector<std::size_t>(const KernelDecomposition&, const Incidence&, const LightTerms&)>;

// Makes the terms of a problem. Kernels end at the radius outside of which they have the fraction `beyond` of their
// power, those of one direction at most a millionth. With coming light, lights of changing directions serve the choice
// of terms alone.
LightTerms light_terms(const Problem& problem, double beyond, const TermChoice& choose);

}  // namespace beamspread
