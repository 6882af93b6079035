// An LDF as cumulative radial functions, one per azimuthal harmonic.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "transport/bins.h"

namespace beamspread {

using Harmonics = std::array<double, harmonic_count>;

// g(r, phi) = sum over m of c_m(r) cos(m phi) around (centre, 0), lengths in mean free paths, kept
// as C_m(r) = integral of c_m(s) s ds from 0 to r: a piecewise cubic through its values at the edges of the
// radius bins, whose power therefore is exactly what was counted.
class RadialProfile {
public:
    RadialProfile();

    // From sums of weight * cos(m phi) per radius bin, [radius bin][harmonic].
    RadialProfile(double centre, std::span<const double> bin_moments);

    // Adds `weight` times another profile, harmonics of even and odd m apart.
    void add(const RadialProfile& other, double even_weight, double odd_weight);

    // C_m(r) for every m.
    Harmonics cumulative(double r) const;

    // C_m(infinity) - C_m(r), which stays accurate where next to nothing is left outside r.
    Harmonics remaining(double r) const;

    // Total power: 2 pi C_0(infinity).
    double total() const;

    // From this radius on the cumulative functions are constant.
    double support() const { return m_support; }

    double centre() const { return m_centre; }

private:
    Harmonics slope_at(std::size_t edge) const;
    void update_support();

    double m_centre = 0.0;
    double m_support = 0.0;
    std::vector<Harmonics> m_remaining;  // at each edge
    std::vector<Harmonics> m_slope;      // dC_m/dr at each edge
    Harmonics m_total{};
};

}  // namespace beamspread
