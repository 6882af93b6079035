// Scatter of the maps between groups of batches: what the standard error of an image comes from.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "transport/tally.h"

namespace beamspread {

// Batches are taken together in this many groups, each a simulation of its own.
inline constexpr std::size_t group_count = 8;

// Albedos at which the groups are kept. A group's deviation from the mean, relative to the power of the ring, changes
// slowly with the albedo: it is interpolated in log(1 - albedo).
inline constexpr std::array<double, 4> scatter_albedos = {0.6, 0.95, 0.995, 0.9995};

// Deviation of each group's moments from those of all, divided by the m = 0 moment of the ring,
// [group][albedo][harmonic][radius bin], for the harmonics that are kept of each order bin. Rounded to five bits,
// enough for an error of an error, so that files stay small.
std::vector<float> relative_deviations(std::span<const Tally* const> groups, std::span<const std::size_t> harmonics);

// The deviations of one group at an albedo, [harmonic][radius bin].
std::vector<double> deviations_at(std::span<const float> deviations, std::size_t group, double albedo);

}  // namespace beamspread
