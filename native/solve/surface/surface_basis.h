// Low-rank basis of the kernels of all angles of incidence, curvatures and media.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "solve/separable/light_terms.h"
#include "solve/surface/pair_lanes.h"

namespace beamspread {

// Number of harmonics, m from 0. More: sharper peaks ahead of grazing light at ior 1, more time.
inline constexpr std::size_t surface_harmonics = 8;

// Functions u(theta) of the light, of which each has moments with cos and sin(m beta). The first is the most important one
// of m = 0.
struct SurfaceBasis {
    SurfaceBasis(const std::vector<ChannelMedium>& channels, double max_angle_deg, double texel, bool is_colored,
                 double tolerance);

    std::size_t functions() const { return harmonic.size(); }

    // Indices of a term's moments among those of a sample: one, or one for each result of its set.
    std::vector<std::size_t> places(std::size_t term) const;

    LightTerms terms;                             // moments' functions, without a plane
    std::vector<std::vector<double>> curvatures;  // [medium], 1 / mean free path
    std::vector<std::size_t> first_profiles;      // [medium]: index of the profiles of the medium's first curvature
    PairLanes lanes;

    // [function]: harmonic m, rank, and largest value; those of large gains first.
    std::vector<std::int32_t> harmonic;
    std::vector<std::size_t> rank;
    std::vector<float> largest;

private:
    std::vector<std::size_t> m_number;  // [function of `terms.basis`]
};

}  // namespace beamspread
