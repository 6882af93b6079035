// Texels at which the radiance is probed, and the radiance there, separately for each function of a basis.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/threads.h"
#include "solve/separable/light_terms.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Largest offset of a site's texels from its middle (17 x 17 texels), and number of texels that are probed in it; their
// mean stands for the mean of all.
inline constexpr std::size_t site_reach = 8;
inline constexpr std::size_t texels_per_site = 9;

// Texels of the probe sites, site after site, from a fixed seed: over the whole plane, at light edges and on their dark
// side, and around the texels where each light is brightest, steepest, most grazing, and nearest to its lamp.
std::vector<Texel> probe_sites(const LightTerms& light, const std::vector<std::size_t>& lights,
                               const Incidence& incidence);

// Texels of sites near some texels; other texels for every `draw`.
std::vector<Texel> sites_around(const std::vector<Texel>& texels, const Plane& plane, std::size_t draw);

// Sums light over rings around a texel, whose width grows with the radius: in each of the same number of directions,
// the light at a random point of the ring times the kernel's integral over the ring. Exact to some per cent, which is
// enough to compare functions.
class RadianceProbe {
public:
    // `lights`: indices of the probed lights of changing direction. All arguments must outlive the probe.
    RadianceProbe(const LightTerms& light, std::vector<std::size_t> lights, const LowRankBasis& basis);

    // Radiance times pi, [texel][result and function], of the texels of a site, which share the far light of its
    // middle.
    std::vector<std::vector<float>> read(std::span<const Texel> site) const;

private:
    void add_rings(const Texel& texel, std::size_t first, std::size_t end, AlignedVector<float>& sums) const;
    void add_beam(const PlaneLight& light, const std::vector<float>& colors, const Texel& texel,
                  const Vec2& toward_probe, AlignedVector<float>& cosines, AlignedVector<float>& moments) const;

    const LightTerms& m_light;
    std::vector<std::size_t> m_lights;
    // Rows of tables have, for each rank, the harmonics up to the basis' last one, in whole blocks; missing ones are
    // zero.
    std::vector<std::size_t> m_positions;  // [function]: column of its harmonic
    std::vector<std::size_t> m_columns;    // [block]: its first harmonic
    std::size_t m_harmonics = 0;
    std::size_t m_row_size = 0;
    float m_first_angle;
    float m_steps_per_angle;
    AlignedVector<float> m_by_angle;  // [step]: functions of the angle
    std::vector<double> m_radii;      // outer radii of the rings, metres
    std::size_t m_near = 0;           // number of rings that each texel of a site sums itself
    AlignedVector<float> m_by_ring;   // [ring][medium]: integrals of c_m(r) over a ring, per direction
};

}  // namespace beamspread
