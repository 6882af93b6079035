#include "ldf/radial/radial_profile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "ldf/radial/radial_function.h"

namespace beamspread {

namespace {

// The light is divided into rings around the old pole, and these into cells, which the fine edges and the harmonics
// around the new pole do not resolve. More rings or cells, or smaller cells: smaller errors, more time.
constexpr int rings_per_octave = 16;
constexpr double cell_size = 0.01;  // over the distance of the poles
constexpr double min_cells = 16.0;  // in half a ring
constexpr double max_cells = 256.0;

// Sums of weight * cos(m phi) around the new pole, [edge][harmonic]: inside each edge and outside the one before.
class Moments {
public:
    // Adds light that is even between two radii, at one cos(phi).
    void add(double r0, double r1, double cos_phi, double weight)
    {
        std::array<double, harmonic_count> harmonics;
        harmonics[0] = weight;
        harmonics[1] = weight * cos_phi;
        for (std::size_t m = 2; m < harmonic_count; ++m)
            harmonics[m] = 2.0 * cos_phi * harmonics[m - 1] - harmonics[m - 2];
        const std::size_t first = edge_beyond(static_cast<float>(r0));
        const std::size_t last = edge_beyond(static_cast<float>(r1));
        for (std::size_t k = first; k <= last; ++k) {
            const double from = k == first ? r0 : radial_edge(k - 1);
            const double to = k == last ? r1 : radial_edge(k);
            const double share = first == last ? 1.0 : std::max(0.0, to - from) / (r1 - r0);
            for (std::size_t m = 0; m < harmonic_count; ++m)
                m_sums[k][m] += share * harmonics[m];
        }
    }

    RadialProfile profile(double centre) const
    {
        std::vector<double> sums;
        for (std::size_t m = 0; m < harmonic_count; ++m)
            for (const auto& between : m_sums)
                sums.push_back(harmonic_taper()[m] * between[m]);
        return RadialProfile(centre, sums, RadialDetail::all);
    }

private:
    std::vector<std::array<double, harmonic_count>> m_sums{edge_count, std::array<double, harmonic_count>{}};
};

// The point (rho, psi) around the old pole, in coordinates around the new one.
struct RingPoint {
    RingPoint(double shift, double rho, double psi)
        : x(shift + rho * std::cos(psi)), y(rho * std::sin(psi)), r(std::hypot(x, y))
    {
    }
    double cos_phi() const { return r > 0.0 ? x / r : 1.0; }
    double x;
    double y;
    double r;
};

// Adds the light between two radii around the old pole.
void add_ring(const RadialProfile& profile, double shift, double inner, double outer, Moments& moments)
{
    const Harmonics from = profile.remaining(inner);
    const Harmonics to = profile.remaining(outer);
    // Compute the power between the azimuths -psi and psi.
    const auto power_to = [&](double psi) {
        const double twice_cosine = 2.0 * std::cos(psi);
        double previous = 0.0;
        double sine = std::sin(psi);
        double sum = (from[0] - to[0]) * psi;
        for (std::size_t m = 1; m < profile.harmonics(); ++m) {
            sum += (from[m] - to[m]) * sine / static_cast<double>(m);
            const double next = twice_cosine * sine - previous;
            previous = sine;
            sine = next;
        }
        return 2.0 * sum;
    };
    const double cells_of_size = std::ceil(pi * outer / (cell_size * std::abs(shift)));
    const auto cells = static_cast<int>(std::clamp(cells_of_size, min_cells, max_cells));
    double power_before = 0.0;
    for (int i = 0; i < cells; ++i) {
        const double psi0 = pi * i / cells;
        const double psi1 = pi * (i + 1) / cells;
        const double power = power_to(psi1);
        const std::array corners = {RingPoint(shift, inner, psi0).r, RingPoint(shift, inner, psi1).r,
                                    RingPoint(shift, outer, psi0).r, RingPoint(shift, outer, psi1).r};
        const auto [nearest, farthest] = std::minmax_element(corners.begin(), corners.end());
        const RingPoint middle(shift, 0.5 * (inner + outer), 0.5 * (psi0 + psi1));
        moments.add(*nearest, *farthest, middle.cos_phi(), power - power_before);
        power_before = power;
    }
}

}  // namespace

RadialProfile on_axis(double from, double to, double power)
{
    Moments moments;
    moments.add(from, to, 1.0, power);
    return moments.profile(0.0);
}

RadialProfile recentred(const RadialProfile& profile, double centre)
{
    const double shift = profile.centre() - centre;
    if (shift == 0.0 || profile.support() == 0.0)
        return profile;
    Moments moments;
    double inner = 0.0;
    for (double outer = radial_edge(0); inner < profile.support(); outer *= std::exp2(1.0 / rings_per_octave)) {
        add_ring(profile, shift, inner, outer, moments);
        inner = outer;
    }
    return moments.profile(centre);
}

}  // namespace beamspread
