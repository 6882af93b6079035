// What an LDF has to know of itself to be integrated over texels.
#pragma once

#include <array>
#include <cmath>

#include "base/constants.h"
#include "transport/tally/bins.h"

namespace beamspread {

using Harmonics = std::array<double, harmonic_count>;

// Weights of the harmonics of light so sharp that it needs more than are counted. Cut off, they would ring around rings
// with a peak, below zero beside it; fading out they do not, and texels finer than the last ones resolve are nearer to the
// truth.
inline const Harmonics& fading_harmonics()
{
    static const Harmonics fading = [] {
        constexpr std::size_t half = harmonic_count / 2;
        Harmonics weights;
        weights.fill(1.0);
        for (std::size_t m = half; m < harmonic_count; ++m)
            weights[m] = 0.5 + 0.5 * std::cos(pi * static_cast<double>(m - half) / half);
        return weights;
    }();
    return fading;
}

// g(r, phi) = sum over m of c_m(r) cos(m phi), as C_m(r) = integral of c_m(s) s ds from 0 to r. Lengths in mean free
// paths.
class RadialFunction {
public:
    virtual ~RadialFunction() = default;

    // Leading harmonics in use: c_m is zero from this m on.
    virtual std::size_t harmonics() const = 0;

    // C_m(r) for every m.
    virtual Harmonics cumulative(double r) const = 0;

    // C_m(infinity) - C_m(r), which stays accurate where next to nothing is left outside r.
    virtual Harmonics remaining(double r) const = 0;

    // From this radius on the cumulative functions are constant.
    virtual double support() const = 0;

    // Radius where c_m may change abruptly; 0: nowhere but at the pole.
    virtual double edge() const { return 0.0; }

protected:
    RadialFunction() = default;
    RadialFunction(const RadialFunction&) = default;
    RadialFunction(RadialFunction&&) = default;
    RadialFunction& operator=(const RadialFunction&) = default;
    RadialFunction& operator=(RadialFunction&&) = default;
};

}  // namespace beamspread
