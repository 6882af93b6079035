// Monte Carlo simulation of one medium for several angles of incidence and curvatures of its surface.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "medium/medium.h"
#include "transport/tally/tally.h"
#include "transport/walk/walk.h"

namespace beamspread {

// Number n of independent batches of photons per angle. Their scatter gives the statistical error of totals, known to
// 1 / sqrt(2 (n - 1)), 13 %; more batches: better known, larger files.
inline constexpr std::size_t batch_count = 32;

// One side of one angle, normalized to one unit of power that entered the medium.
struct SideResult {
    std::vector<float> power;            // [row][radius bin]; empty if no light leaves here
    std::size_t radii = 0;               // number of radius bins up to the last non-empty one, at least 1
    std::vector<std::size_t> harmonics;  // [row]: number of stored harmonics, at least 1: `significant_harmonics`
    // Means of cos(m phi) weighted by power, m > 0, rounded to half precision: [row][harmonic][radius bin].
    std::vector<float> ratios;
    std::vector<float> mean_order;  // [order bin]
    std::vector<float> order_variance;  // [order bin]
    std::vector<float> batch_totals;  // [batch][order bin], power
    std::vector<float> deviations;  // of groups of batches: `relative_deviations`
};

struct AngleResult {
    double angle_deg = 0.0;  // outside the medium, from the normal
    std::array<SideResult, side_count> sides;
};

// A beam on the surface.
struct Beam {
    double angle_deg = 0.0;  // outside the medium, from the normal, in [0, 90)
    double curvature = 0.0;  // of the surface, 1 / mean free path: 1 / radius of a ball, negative round a hollow
    std::uint64_t photons = 0;
};

// Walks the photons of each beam. On a curved surface, which only a half-space may have, radii are chords: straight
// distances from entry to exit, with their azimuths in the tangent plane of the entry. Light is counted when it leaves,
// if it has scattered; what crosses a hollow and enters again is not followed. The result of a beam depends on seed,
// beam and kernel (a name from walk_kernels(); empty: the fastest), never on threads. Throws InvalidArgument, Cancelled.
std::vector<AngleResult> simulate(const Medium& medium, std::span<const Beam> beams, std::uint64_t seed, int threads,
                                  std::string_view kernel_name, Progress& progress);

}  // namespace beamspread
