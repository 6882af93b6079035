// Terms of kernels: harmonics of profiles, with lengths in metres.
#pragma once

#include <cstddef>

#include "ldf/radial/radial_profile.h"

namespace beamspread {

enum class Phase { cosine, sine };

// Part of a kernel: `weight` times the harmonic m of a profile.
struct KernelTerm {
    std::size_t profile;
    std::size_t m;
    Phase phase;
    double weight;
};

// Harmonics [first, end).
struct HarmonicRange {
    std::size_t first = 0;
    std::size_t end = 0;
};

struct ScaledProfile {
    RadialProfile profile;
    double mean_free_path = 1.0;  // metres
    double reach = 0.0;           // metres; the profile counts as zero beyond
};

}  // namespace beamspread
