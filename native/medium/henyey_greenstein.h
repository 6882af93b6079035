// Henyey-Greenstein phase function (Henyey, Greenstein 1941, doi:10.1086/144246).
#pragma once

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

// Density per steradian of a deflection with cosine cos_theta.
inline double henyey_greenstein_pdf(double cos_theta, double g)
{
    const double denominator = 1.0 + g * g - 2.0 * g * cos_theta;
    return inv_pi / 4.0 * (1.0 - g * g) / (denominator * std::sqrt(denominator));
}

// Cosine of a deflection, by inverting the distribution function at u in [0, 1).
inline double henyey_greenstein_sample(double g, double u)
{
    // Below this |g| the formula's cancellation error exceeds the error of isotropic scattering.
    if (std::abs(g) < 1e-4)
        return 1.0 - 2.0 * u;
    const double ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    return std::clamp((1.0 + g * g - ratio * ratio) / (2.0 * g), -1.0, 1.0);
}

}  // namespace beamspread
