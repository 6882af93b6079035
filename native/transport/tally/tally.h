// Tally of the light that leaves one side of the medium, by scattering order, pole, radius and azimuthal harmonic, and
// statistics of finished tallies.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/platform.h"
#include "medium/medium.h"
#include "transport/tally/bins.h"

namespace beamspread {

enum class Side : std::size_t { reflected = 0, transmitted = 1 };
inline constexpr std::size_t side_count = 2;

// Light that leaves after few scatterings peaks, as 1 / r and sharper, at the beam's entry and exit, and in a slab also
// around the beam's mirror images in the boundaries. Harmonics around one of these points do not resolve another, and
// interpolation between angles fails because the images move. Each side therefore has several poles along the beam: its
// entry (or first exit on the far side), and its next exits.

// Largest number of reflections that an exit distinguishes. Reflections count while they follow the beam's order: the
// far boundary first, then in turn.
inline constexpr std::uint32_t max_reflections = 2 * (pole_count - 1);

inline constexpr std::uint32_t reflections_after(std::uint32_t reflections, bool at_far_boundary)
{
    const bool as_the_beam = at_far_boundary == (reflections % 2 == 0);
    return as_the_beam && reflections < max_reflections ? reflections + 1 : reflections;
}

// Pole of light after these reflections: the beam's latest exit. Later exits have no sharp light of it.
inline constexpr std::size_t pole_of(std::uint32_t reflections, Side side)
{
    return (reflections + (side == Side::reflected ? 1 : 0)) / 2;
}

// u of each pole, [side][pole], mean free paths.
using PolePositions = std::array<std::array<double, pole_count>, side_count>;
PolePositions pole_positions(const Medium& medium, double theta_inside);

// Number of scattering orders, from 0, that are tallied around their own poles; higher orders are tallied around the
// first. 0: the medium shows no mirror images.
std::uint32_t mirrored_orders(const Medium& medium);

// Largest number of harmonics in the rows of a pole; `harmonics` has the number of each row.
inline std::size_t max_harmonics(std::span<const std::size_t> harmonics, std::size_t pole)
{
    const auto rows = harmonics.subspan(first_row(pole), end_row(pole) - first_row(pole));
    return *std::max_element(rows.begin(), rows.end());
}

// One number for each bin.
using OrderWeights = std::array<double, order_bin_count>;

// Sums over photons of weight * cos(m phi), with (r, phi) the point of exit around a pole and phi = 0 along the beam's
// direction of travel. The walk absorbs nothing: an albedo a scales the sums of order n by a^n, so one simulation
// serves all albedos (Kienle, Patterson 1996, Phys. Med. Biol. 41, 2221).
struct Tally {
    std::array<double, pole_count> poles{};  // u, mean free paths
    std::uint32_t mirrored_orders = 0;       // see transport/tally/tally.h
    // [row][radius bin][harmonic], see `ring`; empty if no light leaves this side
    std::vector<double, HugePageAllocator<double>> moments;
    OrderWeights weight{};         // sum of weight, [order bin], around all poles
    OrderWeights weight_order{};   // sum of weight * order
    OrderWeights weight_order2{};  // sum of weight * order^2

    void allocate() { moments.assign(ring_offsets.back(), 0.0); }

    double* ring(std::size_t row, std::size_t radius)
    {
        return moments.data() + ring_offsets[row] + radius * harmonics_of(row);
    }
    const double* ring(std::size_t row, std::size_t radius) const
    {
        return moments.data() + ring_offsets[row] + radius * harmonics_of(row);
    }

    void add(double u, double v, std::uint32_t order, std::size_t pole_of_exit, double w)
    {
        const std::size_t pole = order < mirrored_orders ? pole_of_exit : 0;
        const double x = u - poles[pole];
        const double r2 = x * x + v * v;
        const double r = std::sqrt(r2);
        const double cos_phi = r > 0.0 ? x / r : 1.0;
        const std::size_t bin = order_bin(order);
        const std::size_t harmonics = harmonics_of(bin);
        double* sums = ring(first_row(pole) + bin, radius_bin(static_cast<float>(r)));
        // Add cos(m phi) by the recurrence of the Chebyshev polynomials.
        double previous = w;
        double current = w * cos_phi;
        sums[0] += previous;
        sums[1] += current;
        for (std::size_t m = 2; m < harmonics; ++m) {
            const double next = 2.0 * cos_phi * current - previous;
            previous = current;
            current = next;
            sums[m] += current;
        }
        const double n = static_cast<double>(order);
        weight[bin] += w;
        weight_order[bin] += w * n;
        weight_order2[bin] += w * n * n;
    }

    void merge(const Tally& tally)
    {
        for (std::size_t row = 0; row < row_count; ++row)
            if (tally.weight[order_bin_of(row)] != 0.0)
                for (std::size_t i = ring_offsets[row]; i < ring_offsets[row + 1]; ++i)
                    moments[i] += tally.moments[i];
        for (std::size_t b = 0; b < order_bin_count; ++b) {
            weight[b] += tally.weight[b];
            weight_order[b] += tally.weight_order[b];
            weight_order2[b] += tally.weight_order2[b];
        }
    }
};

// Number of leading harmonics of each row, at least one, that reduce the error: their signal exceeds their noise.
// `first` and `second` are the tallies of two halves of a simulation: the mean of their product is the signal, their
// difference is noise.
std::array<std::size_t, row_count> significant_harmonics(const Tally& first, const Tally& second);

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
