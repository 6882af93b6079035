// Scatter of the maps between groups of batches: what the standard error of an image comes from.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "medium/medium.h"
#include "transport/tally.h"

namespace beamspread {

// Batches are taken together in this many groups, each a simulation of its own.
inline constexpr std::size_t group_count = 8;

// Albedos at which the groups are kept. A group's deviation from the mean, relative to the power of the ring, changes
// slowly with the albedo: it is interpolated in log(1 - albedo).
inline constexpr std::array<double, 4> scatter_albedos = {0.6, 0.95, 0.995, 0.9995};

// Of the first `radii` bins, those that deviations are kept of at one of these albedos: all that are counted apart, but
// for slabs thin enough for the finer bins. Light leaves these after so few scatterings that from the third albedo on
// deviations hardly change: the finer bins and those within them have those of the second albedo, and at the fourth all
// have those of the third. Over six such slabs, texels of .05 to 1 mean free path, standard errors at albedos from .995
// on move by 1 % in the median, and by 13 % at most in 98 of 100 texels.
std::vector<std::size_t> scatter_bins(const Medium& medium, std::size_t albedo, std::size_t radii);

// How many deviations of one harmonic are kept of a group, at all albedos.
std::size_t scatter_count(const Medium& medium, std::size_t radii);

// Deviation of each group's moments from those of all, divided by the m = 0 moment of the ring,
// [group][albedo][harmonic][one of scatter_bins()], for the harmonics that are kept of each order bin. Rounded to five
// bits, enough for an error of an error, so that files stay small: with fewer, harmonics that cancel where no light
// leaves would not.
std::vector<float> relative_deviations(const Medium& medium, std::span<const Tally* const> groups,
                                       std::span<const std::size_t> harmonics, std::size_t radii);

// The deviations of one group at an albedo, [harmonic][radius bin].
std::vector<double> deviations_at(const Medium& medium, std::span<const float> deviations, std::size_t radii,
                                  std::size_t group, double albedo);

}  // namespace beamspread
