// Low-rank basis of the kernels of all angles of incidence, curvatures and media.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "solve/separable/light_terms.h"

namespace beamspread {

// Lanes of a block of functions: one vector.
inline constexpr std::size_t lanes_per_block = 16;

// Number of harmonics, m from 0. More: sharper peaks ahead of grazing light at ior 1, more time.
inline constexpr std::size_t surface_harmonics = 8;

// Functions u(theta) of the light, of which each has moments with cos and sin(m beta), one in each lane of the blocks.
// The first is the most important one of m = 0.
struct SurfaceBasis {
    SurfaceBasis(const std::vector<ChannelMedium>& channels, double max_angle_deg, double texel, bool is_colored,
                 double tolerance);

    // Number of lanes.
    std::size_t functions() const { return blocks * lanes_per_block; }

    // Number of moments of a sample, [set][block][cosine, sine][lane].
    std::size_t moments() const { return terms.sets.count() * 2 * functions(); }

    // Index of a term's moment among those of a sample.
    std::size_t place(std::size_t term) const;

    LightTerms terms;                             // moments' functions, without a plane
    std::vector<std::vector<double>> curvatures;  // [medium], 1 / mean free path
    std::vector<std::size_t> first_profiles;      // [medium]: index of the profiles of the medium's first curvature
    std::size_t blocks = 0;

    // [lane]: harmonic m of its function, rank, and its largest value. Lanes without a function are at the end, with m = 0 in `harmonic`.
    std::vector<std::int32_t> harmonic;
    std::vector<std::size_t> rank;
    std::vector<float> largest;

private:
    std::vector<std::size_t> m_lane;  // [function of `terms.basis`]
};

}  // namespace beamspread
