// Statistics of finished tallies: the harmonics above the noise, and the scatter of maps between groups of batches.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "transport/tally/tally.h"

namespace beamspread {

// Number of leading harmonics of each row, at least one, that reduce the error: their signal exceeds their noise.
// `half` and `other` are the tallies of two halves of a simulation: the mean of their product is the signal, their
// difference is noise.
std::array<std::size_t, row_count> significant_harmonics(const Tally& half, const Tally& other);

// Number n of groups of batches, each an independent simulation. The standard error of a texel is known to
// 1 / sqrt(2 (n - 1)), 27 %; more groups: better known, larger files.
inline constexpr std::size_t group_count = 8;

// Number of deviations in a group, for these numbers of harmonics in each row and of radius bins.
std::size_t deviation_count(std::span<const std::size_t> harmonics, std::size_t radii);

// Deviation of each group's moments from their mean, divided by the m = 0 moment of the ring,
// [group][pole][albedo][harmonic][radius bin], for the harmonics of the pole's rows. Rounding to five bits keeps files
// small; with fewer bits, harmonics that cancel where no light leaves would not cancel any more.
std::vector<float> relative_deviations(std::span<const Tally* const> groups, std::span<const std::size_t> harmonics,
                                       std::size_t radii);

// Deviations of one group around a pole, interpolated to an albedo, [harmonic][radius bin].
std::vector<double> deviations_at(std::span<const float> deviations, std::span<const std::size_t> harmonics,
                                  std::size_t radii, std::size_t group, std::size_t pole, double albedo);

}  // namespace beamspread
