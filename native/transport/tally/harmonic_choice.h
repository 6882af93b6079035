// How many harmonics of each order of scattering say more than noise.
#pragma once

#include <array>
#include <cstddef>

#include "transport/tally/tally.h"

namespace beamspread {

// Leading harmonics of each row that are worth keeping, at least one, from two halves of a simulation. Their sums
// differ by noise only, and their product's mean is what is there.
std::array<std::size_t, row_count> harmonics_worth_keeping(const Tally& half, const Tally& other);

}  // namespace beamspread
