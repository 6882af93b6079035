// Monte Carlo simulation of one medium for several angles of incidence.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "medium/medium.h"
#include "transport/tally/tally_statistics.h"
#include "transport/walk/walk.h"

namespace beamspread {

// Photons are walked in this many independent batches per angle: their scatter is the statistical error,
// known to 1 / sqrt(2 (32 - 1)), 13 %; with half as many to 18 %, with twice to 9 %.
inline constexpr std::size_t batch_count = 32;

// One side of one angle, normalized to one unit of power that entered the medium.
struct SideResult {
    std::vector<float> power;         // [row][radius bin]; empty: nothing leaves here
    std::size_t radii = 0;            // radius bins up to the last that is not empty, at least 1
    std::vector<std::size_t> harmonics;  // [row]: how many are kept, at least 1, see transport/tally/tally_statistics.h
    std::vector<float>
        ratios;  // means of cos(m phi) weighted by power, m > 0: [row][harmonic][radius bin], as half holds them
    std::vector<float> mean_order;  // [order bin]
    std::vector<float> order_variance;  // [order bin]
    std::vector<float> batch_totals;  // [batch][order bin], power
    std::vector<float> deviations;  // of groups of batches, see transport/tally/tally_statistics.h
};

struct AngleResult {
    double angle_deg = 0.0;  // outside the medium, from the normal
    std::array<SideResult, side_count> sides;
};

// `photons` per angle. The result depends on seed, photons and kernel (a name of walk_kernels(), or empty: the
// fastest), never on threads. Throws InvalidArgument, Cancelled.
std::vector<AngleResult> simulate(const Medium& medium, std::span<const double> angles_deg, std::uint64_t photons,
                                  std::uint64_t seed, int threads, std::string_view kernel_name, Progress& progress);

}  // namespace beamspread
