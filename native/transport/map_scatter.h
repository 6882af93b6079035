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

inline constexpr std::size_t ring_value_count = radius_bin_count * harmonic_count;

// Collects the moments of one side of one angle by group, orders already contracted.
class MapScatter {
public:
    MapScatter();

    void add(std::size_t group, const Tally& batch);

    // Deviation of each group's moments from those of all, divided by the m = 0 moment of the ring,
    // [group][albedo][radius bin][harmonic]. Rounded to five bits, enough for an error of an error, so that files
    // stay small.
    std::vector<float> relative_deviations() const;

private:
    std::vector<double> m_moments;  // as above, sums over the group's batches
};

// The deviations of one group at an albedo, [radius bin][harmonic].
std::vector<double> deviations_at(std::span<const float> deviations, std::size_t group, double albedo);

}  // namespace beamspread
