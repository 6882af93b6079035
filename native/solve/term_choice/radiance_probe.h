// Radiance at single texels of a plane, separately for each function of a basis.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/threads.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

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
