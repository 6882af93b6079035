#include "transport/simulation.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>
#include <string>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"
#include "medium/medium.h"
#include "transport/tally/tally.h"

namespace beamspread {

namespace {

// Photons in one thread's job up to which its batches are joined. More: fewer idle lanes at a job's end, fewer jobs for
// threads to share.
constexpr std::uint64_t max_photons_per_job = 200'000;

// Consecutive batches in a group (transport/tally/tally.h).
constexpr std::size_t batches_per_group = batch_count / group_count;

SideTallies empty_tallies(const Medium& medium, double theta_inside)
{
    const PolePositions poles = pole_positions(medium, theta_inside);
    SideTallies tallies;
    for (std::size_t side = 0; side < side_count; ++side) {
        tallies[side].poles = poles[side];
        tallies[side].mirrored_orders = mirrored_orders(medium);
    }
    tallies[0].allocate();
    if (!medium.is_half_space())
        tallies[1].allocate();
    return tallies;
}

// Sums of groups of batches, and the total of each batch.
struct AngleSums {
    std::array<SideTallies, group_count> groups;
    std::array<std::vector<double>, side_count> batch_totals;
};

// Sum of every `step`-th group, from group `first` on.
Tally sum_of(const AngleSums& sums, std::size_t side, std::size_t first, std::size_t step)
{
    Tally sum = sums.groups[first][side];
    for (std::size_t group = first + step; group < group_count; group += step)
        sum.merge(sums.groups[group][side]);
    return sum;
}

// Nearest number in half precision, for numbers up to 1.
float rounded_to_half(double x)
{
    constexpr int digits = 11;
    constexpr int min_exponent = -13;  // of frexp's fraction; smaller numbers lose digits
    int exponent = 0;
    std::frexp(x, &exponent);
    const double unit = std::ldexp(1.0, std::max(exponent, min_exponent) - digits);
    return static_cast<float>(std::round(x / unit) * unit);
}

void normalize_rings(const Tally& tally, double photons, SideResult& out)
{
    out.power.reserve(row_count * radius_bin_count);
    for (std::size_t row = 0; row < row_count; ++row) {
        for (std::size_t k = 0; k < radius_bin_count; ++k)
            out.power.push_back(static_cast<float>(tally.ring(row, k)[0] / photons));
        for (std::size_t m = 1; m < out.harmonics[row]; ++m)
            for (std::size_t k = 0; k < radius_bin_count; ++k) {
                const double* ring = tally.ring(row, k);
                out.ratios.push_back(ring[0] > 0.0 ? rounded_to_half(ring[m] / ring[0]) : 0.0F);
            }
    }
}

// Number of radius bins up to the last one with light, at least one.
std::size_t used_radii(const std::vector<float>& power)
{
    std::size_t used = 1;
    for (std::size_t bin = 0; bin < power.size(); ++bin)
        if (power[bin] != 0.0F)
            used = std::max(used, bin % radius_bin_count + 1);
    return used;
}

AngleResult normalized(double angle_deg, const AngleSums& sums, double photons)
{
    AngleResult result;
    result.angle_deg = angle_deg;
    for (std::size_t side = 0; side < side_count; ++side) {
        SideResult& out = result.sides[side];
        if (sums.groups[0][side].moments.empty())
            continue;
        Tally tally = sum_of(sums, side, 0, 2);
        const Tally odd_groups = sum_of(sums, side, 1, 2);
        out.harmonics.assign(row_count, 1);
        if (angle_deg > 0.0) {  // at 0 degrees, symmetry makes all harmonics m > 0 noise
            const auto counts = significant_harmonics(tally, odd_groups);
            out.harmonics.assign(counts.begin(), counts.end());
        }
        tally.merge(odd_groups);
        normalize_rings(tally, photons, out);
        out.radii = used_radii(out.power);
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
        std::array<const Tally*, group_count> groups{};
        for (std::size_t group = 0; group < group_count; ++group)
            groups[group] = &sums.groups[group][side];
        out.deviations = relative_deviations(groups, out.harmonics, out.radii);
    }
    return result;
}

// Sums of one thread's job: consecutive batches.
struct JobSums {
    std::vector<SideTallies> groups;
    std::vector<SideWeights> batches;
};

void merge(std::size_t first_batch, JobSums job, AngleSums& sums)
{
    for (const SideWeights& sides : job.batches)
        for (std::size_t side = 0; side < side_count; ++side)
            sums.batch_totals[side].insert(sums.batch_totals[side].end(), sides[side].begin(), sides[side].end());
    for (std::size_t i = 0; i < job.groups.size(); ++i) {
        SideTallies& group = sums.groups[first_batch / batches_per_group + i];
        if (group[0].moments.empty())
            group = std::move(job.groups[i]);
        else
            for (std::size_t side = 0; side < side_count; ++side)
                group[side].merge(job.groups[i][side]);
    }
}

// Photons of each batch. The first batches take one more where the photons do not divide evenly.
std::vector<std::uint64_t> batch_sizes(std::uint64_t photons)
{
    std::vector<std::uint64_t> sizes(batch_count, photons / batch_count);
    for (std::size_t b = 0; b < photons % batch_count; ++b)
        ++sizes[b];
    return sizes;
}

// Number of batches that one thread walks together. The last walks of a job leave most lanes idle, hence jobs should be
// long.
std::size_t batches_per_job(std::uint64_t photons)
{
    std::size_t batches = batch_count;
    while (batches > 1 && photons / batch_count * batches > max_photons_per_job)
        batches /= 2;
    return batches;
}

WalkKernel find_kernel(std::string_view name)
{
    const std::vector<WalkKernel> kernels = walk_kernels();
    if (name.empty())
        return kernels.front();
    std::ostringstream allowed;
    allowed << "empty (the fastest)";
    for (const WalkKernel& kernel : kernels) {
        if (kernel.name == name)
            return kernel;
        allowed << ", '" << kernel.name << "'";
    }
    reject("kernel", "'" + std::string(name) + "'", allowed.str());
}

}  // namespace

std::vector<AngleResult> simulate(const Medium& medium, std::span<const double> angles_deg, std::uint64_t photons,
                                  std::uint64_t seed, int threads, std::string_view kernel_name, Progress& progress)
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

    const WalkKernel kernel = find_kernel(kernel_name);
    const std::vector<std::uint64_t> batches = batch_sizes(photons);
    const std::size_t per_job = batches_per_job(photons);
    const std::size_t jobs_per_angle = batch_count / per_job;

    const auto walk_job = [&](std::size_t item) {
        const double angle = angles_deg[item / jobs_per_angle];
        const double theta = refracted_angle(angle * radians_per_degree, medium.ior);
        const std::size_t first = item % jobs_per_angle * per_job;
        JobSums sums;
        for (std::size_t batch = 0; batch < per_job; batch += batches_per_group)
            sums.groups.push_back(empty_tallies(medium, theta));
        sums.batches.resize(per_job);
        kernel.walk({medium, theta, seed, std::bit_cast<std::uint64_t>(angle), first,
                     std::span(batches).subspan(first, per_job), batches_per_group, sums.groups, sums.batches,
                     progress});
        return sums;
    };

    std::vector<AngleResult> results;
    AngleSums sums;
    const auto merge_job = [&](std::size_t item, JobSums job_sums) {
        const std::size_t job = item % jobs_per_angle;
        if (job == 0)
            sums = AngleSums{};
        merge(job * per_job, std::move(job_sums), sums);
        if (job + 1 == jobs_per_angle)
            results.push_back(normalized(angles_deg[item / jobs_per_angle], sums, total_photons));
    };
    with_threads(threads, [&] {
        parallel_ordered(angles_deg.size() * jobs_per_angle, [&](std::size_t item) {
            return [&, item, sums = walk_job(item)]() mutable { merge_job(item, std::move(sums)); };
        });
    });
    progress.finish();
    return results;
}

}  // namespace beamspread
