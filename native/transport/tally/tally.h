// Tally of the light that leaves one side of the medium, by scattering order, radius and azimuthal harmonic.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/platform.h"
#include "transport/tally/bins.h"
#include "transport/tally/poles.h"

namespace beamspread {

// Largest number of harmonics in the rows of a pole; `harmonics` has the number of each row.
inline std::size_t max_harmonics(std::span<const std::size_t> harmonics, std::size_t pole)
{
    const auto rows = harmonics.subspan(first_row(pole), end_row(pole) - first_row(pole));
    return *std::max_element(rows.begin(), rows.end());
}

// One number for each bin.
using OrderWeights = std::array<double, order_bin_count>;

// Sums over photons of weight * cos(m phi), with (r, phi) the point of exit around a pole and phi = 0 along the beam's
// direction of travel. The walk absorbs nothing: an albedo a scales the sums of order n by a^n.
struct Tally {
    std::array<double, pole_count> poles{};  // u, mean free paths
    std::uint32_t mirrored_orders = 0;       // see transport/tally/poles.h
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

    void merge(const Tally& other)
    {
        for (std::size_t row = 0; row < row_count; ++row)
            if (other.weight[order_bin_of(row)] != 0.0)
                for (std::size_t i = ring_offsets[row]; i < ring_offsets[row + 1]; ++i)
                    moments[i] += other.moments[i];
        for (std::size_t b = 0; b < order_bin_count; ++b) {
            weight[b] += other.weight[b];
            weight_order[b] += other.weight_order[b];
            weight_order2[b] += other.weight_order2[b];
        }
    }
};

}  // namespace beamspread
