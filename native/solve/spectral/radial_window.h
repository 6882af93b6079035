// Smooth windows that divide a kernel into rings, with the error function as in Ewald's sums (Ewald 1921,
// doi:10.1002/andp.19213690304).
#pragma once

#include <cmath>
#include <numbers>

namespace beamspread {

// Radius around which a window of standard deviation 1 falls like erfc, and its end. The window's error is erfc(4.75 /
// sqrt(2)) / 2 = 1.0e-6 at its pole and erfc(4.5 / sqrt(2)) / 2 = 3.4e-6 at its end. Larger: smaller errors, more time.
inline constexpr double window_radius = 4.75;
inline constexpr double window_end = 9.25;

// The ring between two windows, tapered at a cut. Lengths are in texels.
struct RadialWindow {
    double inner = 0.0;  // standard deviation of the inner window, which the ring excludes
    double outer = 0.0;  // standard deviation of the outer window, outside of which the ring ends; 0: none
    double cut = 0.0;    // radius at which the taper begins
    double taper = 0.0;  // length over which it falls to zero

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
