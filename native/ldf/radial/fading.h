// Light that needs more harmonics than are kept.
#pragma once

#include <array>
#include <cmath>

#include "base/constants.h"
#include "transport/tally/bins.h"

namespace beamspread {

// Weights of the harmonics of light so sharp that it needs more than are counted. Cut off, they would ring around rings
// with a peak, below zero beside it; fading out they do not, and texels finer than the last ones resolve are nearer to the
// truth.
inline const std::array<double, harmonic_count>& fading_harmonics()
{
    static const std::array<double, harmonic_count> fading = [] {
        constexpr std::size_t half = harmonic_count / 2;
        std::array<double, harmonic_count> weights;
        weights.fill(1.0);
        for (std::size_t m = half; m < harmonic_count; ++m)
            weights[m] = 0.5 + 0.5 * std::cos(pi * static_cast<double>(m - half) / half);
        return weights;
    }();
    return fading;
}

}  // namespace beamspread
