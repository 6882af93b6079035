#include "transport/simulation.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"
#include "medium/fresnel.h"

namespace beamspread {

namespace {

constexpr std::uint64_t photons_per_progress = 512;

// Light forgets the beam's direction after a transport mean free path, so that is where the far side's
// distribution is centred, or where the beam leaves a thinner slab.
double far_side_centre(const Medium& medium, double theta_inside)
{
    const double path = std::min(1.0 / (1.0 - medium.g), medium.thickness / std::cos(theta_inside));
    return std::sin(theta_inside) * path;
}

SideTallies empty_tallies(const Medium& medium, double theta_inside)
{
    SideTallies tallies;
    tallies[0].allocate();
    if (!medium.is_half_space()) {
        tallies[1].allocate();
        tallies[1].centre = far_side_centre(medium, theta_inside);
    }
    return tallies;
}

// Sums of batches, and what is kept of each.
struct AngleSums {
    SideTallies total;
    std::array<std::vector<double>, side_count> batch_totals;
    std::array<MapScatter, side_count> scatter;
};

AngleResult normalized(double angle_deg, const AngleSums& sums, double photons)
{
    AngleResult result;
    result.angle_deg = angle_deg;
    for (std::size_t side = 0; side < side_count; ++side) {
        const Tally& tally = sums.total[side];
        SideResult& out = result.sides[side];
        out.centre = tally.centre;
        if (tally.moments.empty())
            continue;
        out.moments.resize(tally.moments.size());
        std::transform(tally.moments.begin(), tally.moments.end(), out.moments.begin(),
                       [photons](double x) { return static_cast<float>(x / photons); });
        out.mean_order.resize(order_bin_count);
        out.order_variance.resize(order_bin_count);
        for (std::size_t b = 0; b < order_bin_count; ++b) {
            const double weight = tally.weight[b];
            if (weight == 0.0)
                continue;
            const double mean = tally.weight_order[b] / weight;
            out.mean_order[b] = static_cast<float>(mean);
            out.order_variance[b] = static_cast<float>(std::max(0.0, tally.weight_order2[b] / weight - mean * mean));
        }
        const double per_photon = static_cast<double>(batch_count) / photons;
        for (double x : sums.batch_totals[side])
            out.batch_totals.push_back(static_cast<float>(x * per_photon));
        out.deviations = sums.scatter[side].relative_deviations();
    }
    return result;
}

}  // namespace

std::vector<AngleResult> simulate(const Medium& medium, std::span<const double> angles_deg, std::uint64_t photons,
                                  std::uint64_t seed, int threads, Progress& progress)
{
    validate(medium);
    if (angles_deg.empty())
        reject("angles", "empty", "at least one angle in degrees, 0 <= angle < 90");
    for (double angle : angles_deg)
        if (!(angle >= 0.0 && angle < 90.0))
            reject("angles", angle, "0 <= angle < 90 degrees");
    if (photons < 1)
        reject("photons", static_cast<double>(photons), "photons >= 1");

    const auto total_photons = static_cast<double>(photons);
    progress.set_total(total_photons * static_cast<double>(angles_deg.size()));

    const auto walk_batch = [&](std::size_t item) {
        const std::size_t angle = item / batch_count;
        const double theta = refracted_angle(angles_deg[angle] * radians_per_degree, medium.ior);
        SideTallies tallies = empty_tallies(medium, theta);
        const std::size_t batch = item % batch_count;
        Random random(seed, std::bit_cast<std::uint64_t>(angles_deg[angle]), batch);
        // The first batches take one more each where the photons do not divide evenly.
        const std::uint64_t batch_photons = photons / batch_count + (batch < photons % batch_count ? 1 : 0);
        for (std::uint64_t done = 0; done < batch_photons;) {
            const std::uint64_t block = std::min(photons_per_progress, batch_photons - done);
            for (std::uint64_t i = 0; i < block; ++i)
                walk_photon(medium, theta, random, tallies);
            done += block;
            progress.advance(static_cast<double>(block));
        }
        return tallies;
    };

    std::vector<AngleResult> results;
    AngleSums sums;
    const auto merge_batch = [&](std::size_t item, SideTallies tallies) {
        const std::size_t batch = item % batch_count;
        if (batch == 0)
            sums = AngleSums{};
        for (std::size_t side = 0; side < side_count; ++side) {
            const auto& weight = tallies[side].weight;
            sums.batch_totals[side].insert(sums.batch_totals[side].end(), weight.begin(), weight.end());
            sums.scatter[side].add(batch % group_count, tallies[side]);
        }
        if (batch == 0)
            sums.total = std::move(tallies);
        else
            for (std::size_t side = 0; side < side_count; ++side)
                sums.total[side].merge(tallies[side]);
        if (batch + 1 == batch_count)
            results.push_back(normalized(angles_deg[item / batch_count], sums, total_photons));
    };
    with_threads(threads,
                 [&] { parallel_ordered<SideTallies>(angles_deg.size() * batch_count, walk_batch, merge_batch); });
    progress.finish();
    return results;
}

}  // namespace beamspread
