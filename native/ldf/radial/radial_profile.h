// An LDF as cumulative radial functions, one per azimuthal harmonic.
#pragma once

#include <span>
#include <vector>

#include "ldf/radial/radial_edges.h"
#include "ldf/radial/radial_function.h"

namespace beamspread {

// g(r, phi) = sum over m of c_m(r) cos(m phi) around (centre, 0), lengths in mean free paths. C_m(r) = integral of
// c_m(s) s ds from 0 to r is a piecewise cubic through its values at the edges of the radius bins, which keeps the
// power of each bin exactly.
class RadialProfile final : public RadialFunction {
public:
    RadialProfile();

    // Makes a profile from sums of weight * cos(m phi) between the edges of this detail, [harmonic][radius]. The cubics
    // meet at these edges.
    RadialProfile(double centre, std::span<const double> bin_moments, RadialDetail detail);

    // Adds a weighted profile, with separate weights for harmonics of even and odd m. Keeps the centre.
    void add(const RadialProfile& other, double even_weight, double odd_weight);

    // Adds a profile with a weight for each harmonic. Keeps the centre.
    void add(const RadialProfile& other, const Harmonics& weights);

    // Drops the harmonics from this m on.
    void keep_harmonics(std::size_t count);

    // Number of leading harmonics that must stay: dropping the others moves at most this power outside r.
    std::size_t harmonics_beyond(double r, double power) const;

    // Drops the trailing harmonics that together move at most this fraction of the power.
    void drop_negligible(double fraction);

    std::size_t harmonics() const override { return m_harmonics; }
    Harmonics cumulative(double r) const override;
    Harmonics remaining(double r) const override;

    // c_m(r), r > 0.
    Harmonics density(double r) const;

    // Total power: 2 pi C_0(infinity).
    double total() const;

    double support() const override { return m_support; }

    // Smallest edge that encloses all but this fraction of the power.
    double reach(double fraction) const;

    double centre() const { return m_centre; }
    void set_centre(double centre) { m_centre = centre; }

    // The edges that the profile follows.
    RadialDetail detail() const { return m_detail; }

private:
    Harmonics slope_at(std::size_t knot, RadialDetail detail) const;
    void subdivide(std::size_t first, std::size_t last);
    void update_support();

    RadialDetail m_detail = RadialDetail::bins;
    std::size_t m_harmonics = 0;
    double m_centre = 0.0;
    double m_support = 0.0;
    std::vector<Harmonics> m_remaining;  // at each edge
    std::vector<Harmonics> m_slope;      // dC_m/dr at each edge
    Harmonics m_total{};
};

// The same distribution around the pole (centre, 0), as exactly as the fine edges and tapered harmonics there resolve
// it: a peak at the old pole is blurred.
RadialProfile recentred(const RadialProfile& profile, double centre);

}  // namespace beamspread
