// Low-rank basis of the kernels of all angles of incidence, curvatures and media.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/light_terms.h"

namespace beamspread {

// Lanes of a block of functions: one vector.
inline constexpr std::size_t lanes_per_block = 16;

// Functions u(theta) cos or sin(m beta) of the light, in blocks of ranks times harmonics: function (rank, m) is number
// rank * harmonics + m, and those that are not needed are zero.
struct SurfaceBasis {
    SurfaceBasis(const std::vector<ChannelMedium>& channels, double max_angle_deg, double texel, bool is_colored,
                 double tolerance);

    std::size_t functions() const { return blocks * lanes_per_block; }

    // Number of moments of a sample, [set][block][cosine, sine][lane].
    std::size_t moments() const { return terms.sets.count() * 2 * functions(); }

    // Index of a term's moment among those of a sample.
    std::size_t place(std::size_t term) const;

    LightTerms terms;                         // moments' functions, without a plane
    std::vector<std::vector<double>> curvatures;  // [medium], 1 / mean free path
    std::vector<std::size_t> first_profiles;      // [medium]: index of the profiles of the medium's first curvature
    std::size_t harmonics = 8;                // 8 or 16
    std::size_t blocks = 0;
};

}  // namespace beamspread
