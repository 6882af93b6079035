// Interface of a radial function that can be integrated over texels.
#pragma once

#include <array>
#include <cmath>

#include "base/constants.h"
#include "transport/tally/bins.h"

namespace beamspread {

using Harmonics = std::array<double, harmonic_count>;

// Weights that taper the highest harmonics (von Hann window) of light that needs more than `harmonic_count`. A sharp
// cut would ring and make values negative beside a peak.
inline const Harmonics& harmonic_taper()
{
    static const Harmonics taper = [] {
        constexpr std::size_t half = harmonic_count / 2;
        Harmonics weights;
        weights.fill(1.0);
        for (std::size_t m = half; m < harmonic_count; ++m)
            weights[m] = 0.5 + 0.5 * std::cos(pi * static_cast<double>(m - half) / half);
        return weights;
    }();
    return taper;
}

// The function g(r, phi) = sum over m of c_m(r) cos(m phi), as C_m(r) = integral of c_m(s) s ds from 0 to r. Lengths
// are in mean free paths.
class RadialFunction {
public:
    virtual ~RadialFunction() = default;

    // Number of harmonics: c_m is zero from this m on.
    virtual std::size_t harmonics() const = 0;

    // C_m(r) for every m.
    virtual Harmonics cumulative(double r) const = 0;

    // C_m(infinity) - C_m(r), accurate even if hardly any light is left outside r.
    virtual Harmonics remaining(double r) const = 0;

    // Radius beyond which g is zero.
    virtual double support() const = 0;

    // Radius of an abrupt change of c_m besides the pole; 0 if there is none.
    virtual double edge() const { return 0.0; }

protected:
    RadialFunction() = default;
    RadialFunction(const RadialFunction&) = default;
    RadialFunction(RadialFunction&&) = default;
    RadialFunction& operator=(const RadialFunction&) = default;
    RadialFunction& operator=(RadialFunction&&) = default;
};

}  // namespace beamspread
