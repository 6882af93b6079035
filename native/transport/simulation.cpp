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

// Largest curvature, 1 / mean free path. Light hardly scatters in smaller balls.
constexpr double max_curvature = 100.0;

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

// Consecutive batches of a beam, for one thread.
struct Job {
    std::size_t beam;
    std::size_t first_batch;
    std::size_t batches;
};

std::vector<Job> jobs_of(std::span<const Beam> beams)
{
    std::vector<Job> jobs;
    for (std::size_t beam = 0; beam < beams.size(); ++beam) {
        const std::size_t per_job = batches_per_job(beams[beam].photons);
        for (std::size_t first = 0; first < batch_count; first += per_job)
            jobs.push_back({beam, first, per_job});
    }
    return jobs;
}

// Stream of a beam's random numbers.
std::uint64_t stream_of(const Beam& beam)
{
    const auto angle = std::bit_cast<std::uint64_t>(beam.angle_deg);
    if (beam.curvature == 0.0)
        return angle;
    return angle ^ (std::bit_cast<std::uint64_t>(beam.curvature) * 0x9e3779b97f4a7c15ULL);
}

void check(const Medium& medium, std::span<const Beam> beams)
{
    if (beams.empty())
        reject("angles", "empty", "at least one angle in degrees, 0 <= angle < 90");
    for (const Beam& beam : beams) {
        if (!(beam.angle_deg >= 0.0 && beam.angle_deg < 90.0))
            reject("angles", beam.angle_deg, "0 <= angle < 90 degrees");
        if (!(std::abs(beam.curvature) <= max_curvature))
            reject("curvatures", beam.curvature, "-100 <= curvature <= 100 per mean free path");
        if (beam.curvature != 0.0 && !medium.is_half_space())
            reject("curvatures", beam.curvature, "0 for a slab: only a half-space has balls and hollows");
        if (beam.photons < 1)
            reject("photons", static_cast<double>(beam.photons), "photons >= 1");
    }
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

std::vector<AngleResult> simulate(const Medium& medium, std::span<const Beam> beams, std::uint64_t seed, int threads,
                                  std::string_view kernel_name, Progress& progress)
{
    validate(medium);
    check(medium, beams);
    double total_photons = 0.0;
    for (const Beam& beam : beams)
        total_photons += static_cast<double>(beam.photons);
    progress.set_total(total_photons);

    const WalkKernel kernel = find_kernel(kernel_name);
    const std::vector<Job> jobs = jobs_of(beams);
    const auto walk_job = [&](const Job& job) {
        const Beam& beam = beams[job.beam];
        const double theta = refracted_angle(beam.angle_deg * radians_per_degree, medium.ior);
        const std::vector<std::uint64_t> batches = batch_sizes(beam.photons);
        JobSums sums;
        for (std::size_t batch = 0; batch < job.batches; batch += batches_per_group)
            sums.groups.push_back(empty_tallies(medium, theta));
        sums.batches.resize(job.batches);
        kernel.walk({medium, beam.curvature, theta, seed, stream_of(beam), job.first_batch,
                     std::span(batches).subspan(job.first_batch, job.batches), batches_per_group, sums.groups,
                     sums.batches, progress});
        return sums;
    };

    std::vector<AngleResult> results;
    AngleSums sums;
    const auto merge_job = [&](const Job& job, JobSums job_sums) {
        if (job.first_batch == 0)
            sums = AngleSums{};
        merge(job.first_batch, std::move(job_sums), sums);
        const Beam& beam = beams[job.beam];
        if (job.first_batch + job.batches == batch_count)
            results.push_back(normalized(beam.angle_deg, sums, static_cast<double>(beam.photons)));
    };
    with_threads(threads, [&] {
        parallel_ordered(jobs.size(), [&](std::size_t item) {
            return [&, item, sums = walk_job(jobs[item])]() mutable { merge_job(jobs[item], std::move(sums)); };
        });
    });
    progress.finish();
    return results;
}

}  // namespace beamspread
