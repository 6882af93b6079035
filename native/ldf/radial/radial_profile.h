// An LDF as cumulative radial functions, one per azimuthal harmonic, and the radii between which these are cubics.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "ldf/radial/radial_function.h"
#include "transport/tally/bins.h"

namespace beamspread {

// Range of the fine edges, as powers of two in mean free paths, and their density, 2^fine_bits per octave. A wider
// range or more edges: smaller errors around mirror images in slabs, more time.
inline constexpr int min_fine_exponent = -5;
inline constexpr int max_fine_exponent = 2;
inline constexpr int fine_bits = 4;
inline constexpr double fine_end = 1 << max_fine_exponent;

// Index of the first fine edge, number of fine edges, and number of bin edges that they replace.
inline constexpr std::size_t first_fine_edge = 4 * std::size_t{min_fine_exponent - min_radius_exponent} + 1;
inline constexpr std::size_t fine_edge_count = std::size_t{max_fine_exponent - min_fine_exponent} << fine_bits;
inline constexpr std::size_t replaced_edge_count = 4 * std::size_t{max_fine_exponent - min_fine_exponent};
inline constexpr std::size_t edge_count = radius_bin_count + fine_edge_count - replaced_edge_count;

// The edges of the bins, enough for light around one pole; or all edges.
enum class RadialDetail { bins, all };

// How a profile ends at the last edge that encloses light: it fades, or stops where a ball has no longer chords.
enum class RadialEnd { faded, abrupt };

// Radius of an edge, mean free paths, ascending.
double radial_edge(std::size_t edge);

// Index of the first edge beyond a radius, at most the last.
inline std::size_t edge_beyond(float radius)
{
    constexpr int bias = 127;
    constexpr int within_finest_bits = 23 - fine_bits;
    const std::size_t bin = radius_bin(radius);
    if (bin < first_fine_edge)
        return bin;
    if (bin >= first_fine_edge + replaced_edge_count)
        return bin + fine_edge_count - replaced_edge_count;
    const std::uint32_t step = std::bit_cast<std::uint32_t>(radius) >> within_finest_bits;
    return first_fine_edge + step - (static_cast<std::uint32_t>(bias + min_fine_exponent) << fine_bits);
}

// Range of radii (mean free paths) in which bins are divided for comparing profiles, and the number of parts. A wider
// range or more parts: smaller errors, more time.
inline constexpr double divided_begin = 0.5;
inline constexpr double divided_end = 4.0;
inline constexpr int bin_steps = 8;

// Radii (mean free paths, ascending) at which profiles are compared and their integrals divided: the edges of this
// detail, and `bin_steps` points per bin between `divided_begin` and `divided_end`.
std::vector<double> profile_radii(RadialDetail detail);

// True if an edge is the edge of a bin.
bool is_bin_edge(std::size_t edge);

// g(r, phi) = sum over m of c_m(r) cos(m phi) around (centre, 0), lengths in mean free paths. C_m(r) = integral of
// c_m(s) s ds from 0 to r is a piecewise cubic through its values at the edges of the radius bins, which keeps the
// power of each bin exactly.
class RadialProfile final : public RadialFunction {
public:
    RadialProfile();

    // Makes a profile from sums of weight * cos(m phi) between the edges of this detail, [harmonic][radius]. The cubics
    // meet at these edges.
    RadialProfile(double centre, std::span<const double> bin_moments, RadialDetail detail,
                  RadialEnd end = RadialEnd::faded);

    // Adds a weighted profile, with separate weights for harmonics of even and odd m. Keeps the centre.
    void add(const RadialProfile& profile, double even_weight, double odd_weight);

    // Adds a profile with a weight for each harmonic. Keeps the centre.
    void add(const RadialProfile& profile, const Harmonics& weights);

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
    Harmonics slope_at(std::size_t knot, RadialDetail detail, RadialEnd end) const;
    double parabola_slope(std::size_t knot, std::span<const std::size_t> edge, std::size_t m) const;
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

// Power on the axis phi = 0, even between two radii (mean free paths), as exactly as the harmonics resolve it.
RadialProfile on_axis(double from, double to, double power);

}  // namespace beamspread
