// An LDF as cumulative radial functions, one per azimuthal harmonic.
#pragma once

#include <span>
#include <vector>

#include "ldf/radial/radial_edges.h"
#include "ldf/radial/radial_function.h"

namespace beamspread {

// g(r, phi) = sum over m of c_m(r) cos(m phi) around (centre, 0), lengths in mean free paths, kept
// as C_m(r) = integral of c_m(s) s ds from 0 to r: a piecewise cubic through its values at the edges of the
// radius bins, whose power therefore is exactly what was counted.
class RadialProfile final : public RadialFunction {
public:
    RadialProfile();

    // From sums of weight * cos(m phi) between the edges of this detail, [harmonic][radius], for as many harmonics as there
    // are. The cubics meet at these edges.
    RadialProfile(double centre, std::span<const double> bin_moments, RadialDetail detail);

    // Adds `weight` times another profile, harmonics of even and odd m apart. The centre stays.
    void add(const RadialProfile& other, double even_weight, double odd_weight);

    // The same with a weight for each harmonic.
    void add(const RadialProfile& other, const Harmonics& weights);

    // Drops those from this m on.
    void keep_harmonics(std::size_t count);

    // Leading harmonics of which none can be dropped without moving more than this power outside r.
    std::size_t harmonics_beyond(double r, double power) const;

    // Drops the trailing harmonics that together move no more than this fraction of the power.
    void drop_negligible(double fraction);

    std::size_t harmonics() const override { return m_harmonics; }
    Harmonics cumulative(double r) const override;
    Harmonics remaining(double r) const override;

    // c_m(r) itself, r > 0.
    Harmonics density(double r) const;

    // Total power: 2 pi C_0(infinity).
    double total() const;

    double support() const override { return m_support; }

    // The least edge that all but this fraction of the power stays within.
    double reach(double fraction) const;

    double centre() const { return m_centre; }
    void set_centre(double centre) { m_centre = centre; }

    // Whether it follows the finer edges.
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

// The same distribution around (centre, 0), as far as harmonics and finer edges there tell: a peak at the old pole is
// blurred as fading harmonics do.
RadialProfile recentred(const RadialProfile& profile, double centre);

}  // namespace beamspread
