// Statistics of finished tallies: the harmonics above the noise, and the scatter of maps between groups of batches.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "transport/tally/tally.h"

namespace beamspread {

// Leading harmonics of each row that are worth keeping, at least one, from two halves of a simulation. Their sums
// differ by noise only, and their product's mean is what is there.
std::array<std::size_t, row_count> harmonics_worth_keeping(const Tally& half, const Tally& other);

// Batches are taken together in this many groups, each a simulation of its own: errors of single texels are known to
// 1 / sqrt(2 (8 - 1)), 27 %; with half as many to 41 %, with twice, and files of twice the deviations, to 18 %.
inline constexpr std::size_t group_count = 8;

// How many deviations are kept of a group, given how many harmonics each row has and of how many radius bins.
std::size_t scatter_count(std::span<const std::size_t> harmonics, std::size_t radii);

// Deviation of each group's moments from those of all, divided by the m = 0 moment of the ring,
// [group][pole][albedo][harmonic][radius bin], for the harmonics that are kept of any row around the pole. Rounded to
// five bits, enough for an error of an error, so that files stay small: with fewer, harmonics that cancel where no light
// leaves would not.
std::vector<float> relative_deviations(std::span<const Tally* const> groups, std::span<const std::size_t> harmonics,
                                       std::size_t radii);

// The deviations of one group around a pole at an albedo, [harmonic][radius bin].
std::vector<double> deviations_at(std::span<const float> deviations, std::span<const std::size_t> harmonics,
                                  std::size_t radii, std::size_t group, std::size_t pole, double albedo);

}  // namespace beamspread
