#include "ldf/radial/fading.h"

#include <cmath>

#include "base/constants.h"

namespace beamspread {

const std::array<double, harmonic_count>& fading_harmonics()
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
