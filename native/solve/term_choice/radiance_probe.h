// Radiance at single texels of a plane, apart by the functions of a basis.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "solve/separable/light_terms.h"
#include "solve/term_choice/probe_tables.h"

namespace beamspread {

// Light of the texels around is taken as it is, that of cells farther away from some of their texels, and kernels are
// integrated over each cell: a treecode (Barnes & Hut 1986, doi:10.1038/324446a0) whose tree is centred on the texel
// looked at. Right to some per cent, which is enough to tell what a function is worth.
class RadianceProbe {
public:
    // `lights`: which of those of changing direction are looked at. All must outlive the probe.
    RadianceProbe(const LightTerms& light, std::vector<std::size_t> lights, const LowRankBasis& basis);

    // [texel][result and function], times pi, of texels that lie near each other: what comes from far away is that of
    // the middle one.
    std::vector<std::vector<float>> read(std::span<const Texel> site) const;

private:
    struct Cell;
    struct Moments;

    void add_cells(const Texel& texel, std::size_t first_size, std::size_t end_size, Moments& moments,
                   AlignedVector<float>& sums) const;
    void add_cell(const Cell& cell, Moments& moments, AlignedVector<float>& sums) const;
    void add_light(const Cell& cell, std::size_t light, Moments& moments) const;

    const LightTerms& m_light;
    std::vector<std::size_t> m_lights;
    ProbeTables m_tables;
};

}  // namespace beamspread
