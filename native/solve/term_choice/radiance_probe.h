// Radiance at single texels of a plane, apart by the functions of a basis.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/threads.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Sums up light ring by ring around a texel, whose width grows with its radius: of each ring the light in as many
// directions, where a ray that way meets it, times the kernel's integral over the ring. Right to some per cent, which is
// enough to tell what a function is worth.
class RadianceProbe {
public:
    // `lights`: which of those of changing direction are looked at. All must outlive the probe.
    RadianceProbe(const LightTerms& light, std::vector<std::size_t> lights, const LowRankBasis& basis);

    // [texel][result and function], times pi, of texels that lie near each other: what comes from far away is that of
    // the middle one.
    std::vector<std::vector<float>> read(std::span<const Texel> site) const;

private:
    void add_rings(const Texel& texel, std::size_t first, std::size_t end, AlignedVector<float>& sums) const;
    void add_beam(const PlaneLight& light, const std::vector<float>& colors, const Texel& texel, const Vec2& way,
                  AlignedVector<float>& cosines, AlignedVector<float>& moments) const;

    const LightTerms& m_light;
    std::vector<std::size_t> m_lights;
    // Rows of tables hold, for each rank, the harmonics up to the last that the basis has, in whole blocks; zero for
    // those that it lacks.
    std::vector<std::size_t> m_places;   // [function]: in a row
    std::vector<std::size_t> m_columns;  // [block]: its first harmonic
    std::size_t m_harmonics = 0;
    std::size_t m_row_size = 0;
    float m_first_angle;
    float m_steps_per_angle;
    AlignedVector<float> m_by_angle;  // [step]: functions of the angle
    std::vector<double> m_radii;      // of the rings, metres
    std::size_t m_near = 0;           // rings that differ from texel to texel of a site
    AlignedVector<float> m_by_ring;   // [ring][medium]: integrals of c_m(r) over a ring, per direction
};

}  // namespace beamspread
