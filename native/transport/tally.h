// What leaves one side of the medium, by scattering order, radius and azimuthal harmonic.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/huge_pages.h"
#include "transport/bins.h"

namespace beamspread {

enum class Side : std::size_t { reflected = 0, transmitted = 1 };
inline constexpr std::size_t side_count = 2;

// One number for each bin.
using OrderWeights = std::array<double, order_bin_count>;

// Sums over photons of weight * cos(m phi), with (r, phi) the place of exit around (centre, 0) and
// phi = 0 along the beam's direction of travel. Conservative walk: albedo a scales order n by a^n.
struct Tally {
    double centre = 0.0;          // u of the pole of (r, phi), mean free paths
    std::uint32_t fine_orders = 0;  // order bins below go by all radius bins, the others by quarters
    // [order bin][radius bin][harmonic], see `ring`; empty: nothing leaves this side
    std::vector<double, HugePageAllocator<double>> moments;
    OrderWeights weight{};
    OrderWeights weight_order{};   // sum of weight * order
    OrderWeights weight_order2{};  // sum of weight * order^2

    void allocate() { moments.assign(ring_offsets.back(), 0.0); }

    double* ring(std::size_t order, std::size_t radius)
    {
        return moments.data() + ring_offsets[order] + radius * harmonics_of(order);
    }
    const double* ring(std::size_t order, std::size_t radius) const
    {
        return moments.data() + ring_offsets[order] + radius * harmonics_of(order);
    }

    void add(double u, double v, std::uint32_t order, double w)
    {
        const double x = u - centre;
        const double r2 = x * x + v * v;
        const double r = std::sqrt(r2);
        const double cos_phi = r > 0.0 ? x / r : 1.0;
        const std::size_t bin = order_bin(order);
        const std::size_t harmonics = harmonics_of(bin);
        const RadialDetail detail = bin < fine_orders ? RadialDetail::all : RadialDetail::quarters;
        double* sums = ring(bin, radius_bin(static_cast<float>(r), detail));
        // cos(m phi) by the recurrence of the Chebyshev polynomials.
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
        for (std::size_t b = 0; b < order_bin_count; ++b) {
            if (other.weight[b] == 0.0)
                continue;
            for (std::size_t i = ring_offsets[b]; i < ring_offsets[b + 1]; ++i)
                moments[i] += other.moments[i];
            weight[b] += other.weight[b];
            weight_order[b] += other.weight_order[b];
            weight_order2[b] += other.weight_order2[b];
        }
    }
};

}  // namespace beamspread
