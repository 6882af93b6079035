// Light that needs more harmonics than are kept.
#pragma once

#include <array>

#include "transport/tally/bins.h"

namespace beamspread {

// Weights of the harmonics of light so sharp that it needs more than are counted. Cut off, they would ring around rings
// with a peak, below zero beside it; fading out they do not, and texels finer than the last ones resolve are nearer to the
// truth.
const std::array<double, harmonic_count>& fading_harmonics();

}  // namespace beamspread
