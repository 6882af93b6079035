// Kernels of all beams of a problem as combinations of a few.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "ldf/radial/texel_integral.h"
#include "solve/problem/problem.h"

namespace beamspread {

// The kernel of a beam at (theta, beta) is the sum over nodes j and harmonics m of
//   weight_j,m(theta) [cos(m beta) A_jm + sin(m beta) B_jm],
// A_jm and B_jm being texel integrals of c_jm(r) cos(m phi) and c_jm(r) sin(m phi).
class BeamBasis {
public:
    // Weights of the nodes for one angle of incidence; even and odd harmonics may differ.
    using Weights = LdfSource::AngleWeights;

    // One direction for the whole grid: one node.
    static BeamBasis uniform(const Vec3& travel);

    // The library's own nodes: exact.
    static BeamBasis library_nodes(const LdfSource& library);

    std::size_t node_count() const { return m_node_count; }

    // Radial profiles of the nodes for a medium.
    std::vector<RadialProfile> profiles(const ChannelMedium& medium) const { return m_profiles(medium); }

    // Weights of the nodes for the beam at a texel.
    Weights weights(const Vec3& direction) const { return m_weights(direction); }

private:
    BeamBasis() = default;

    std::size_t m_node_count = 0;
    std::function<std::vector<RadialProfile>(const ChannelMedium&)> m_profiles;
    std::function<Weights(const Vec3&)> m_weights;
};

// Texel integrals of one profile for some rows of the quadrant of offsets (0 .. height - 1, 0 .. width - 1) around the
// texel where the beam enters; the other quadrants follow by symmetry.
class QuadrantRows {
public:
    QuadrantRows() = default;
    QuadrantRows(const RadialProfile& profile, const Plane& plane, const ChannelMedium& medium, std::size_t first,
                 std::size_t count);

    // The sum over m of cosine[m] A_m + sine[m] B_m for the row offset dy and dx = -(width - 1) .. width - 1.
    void row(std::ptrdiff_t dy, const Harmonics& cosine, const Harmonics& sine, std::vector<double>& values) const;

private:
    std::size_t m_first = 0;
    std::size_t m_width = 0;
    std::size_t m_texels = 0;
    TexelIntegrals m_integrals;
};

}  // namespace beamspread
