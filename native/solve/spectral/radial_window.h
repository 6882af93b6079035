// Smooth rings that a kernel is cut into.
#pragma once

#include <cmath>
#include <numbers>

namespace beamspread {

// A window of standard deviation 1 falls like erfc around this radius; at its pole it is within erfc(4.75 / sqrt(2)) / 2 =
// 1.0e-6 of 1, at its end within erfc(4.5 / sqrt(2)) / 2 = 3.4e-6 of 0. Half a deviation less each: 1.1e-5 and 3.2e-5.
inline constexpr double window_radius = 4.75;
inline constexpr double window_end = 9.25;

// What is between two windows, up to a cut; lengths in texels.
struct RadialWindow {
    double inner = 0.0;  // standard deviations: the inner window is left out;
    double outer = 0.0;  // of the outer one only the inside is kept; 0: no such window
    double cut = 0.0;    // the ring is whole up to here,
    double taper = 0.0;  // and falls to zero over this length beyond

    double end() const { return cut + taper; }

    double weight(double r) const
    {
        return (outside(r, inner) - (outer > 0.0 ? outside(r, outer) : 0.0)) * before_cut(r);
    }

private:
    static double outside(double r, double deviation)
    {
        return 0.5 * std::erfc((window_radius - r / deviation) / std::numbers::sqrt2);
    }

    double before_cut(double r) const
    {
        if (r <= cut)
            return 1.0;
        if (r >= cut + taper)
            return 0.0;
        const double t = 1.0 - (r - cut) / taper;
        return t * t * t * (10.0 + t * (6.0 * t - 15.0));
    }
};

}  // namespace beamspread
