// Figure of merit, 1 / (variance x time), of the simulation against a plain photon walk, at albedo .999 and 45 degrees.
//
// The plain walk follows the textbooks: photons lose weight at every scattering, leave when they cross the surface
// (Fresnel decides), are ended by roulette when their weight is small, and one albedo is tallied. Both are compiled
// with the same flags.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "base/constants.h"
#include "base/random.h"
#include "ldf/library/ldf_library.h"
#include "medium/medium.h"

using namespace beamspread;

namespace {

constexpr double albedo = 0.999;
constexpr double angle_deg = 45.0;
// The scatter between so many runs, as many as take this long, is known to within 7 to 22 per cent of the variance.
constexpr int most_seeds = 400;
constexpr int least_seeds = 40;
constexpr double enough_seconds = 20.0;

struct Result {
    double total = 0.0;
    double ring = 0.0;
    double bias = 0.0;  // that the total may have; the scatter between seeds doesn't show it
};

struct Ring {
    double inner;
    double outer;
};

// From one to two transport mean free paths around O.
Ring mid_range(const Medium& medium)
{
    return {1.0 / (1.0 - medium.g), 2.0 / (1.0 - medium.g)};
}

// Returns the photon's weight in the total and in the ring.
Result plain_photon(const Medium& medium, double theta_inside, const Ring& ring, Random& random)
{
    double x = 0.0, y = 0.0, z = 0.0;
    double wx = std::sin(theta_inside), wy = 0.0, wz = std::cos(theta_inside);
    double weight = 1.0;
    while (true) {
        double flight = -std::log(random.uniform_positive());
        while (z + flight * wz < 0.0 || z + flight * wz > medium.thickness) {
            const double surface = wz < 0.0 ? 0.0 : medium.thickness;
            const double to_surface = (surface - z) / wz;
            x += to_surface * wx;
            y += to_surface * wy;
            z = surface;
            flight -= to_surface;
            if (random.uniform() >= fresnel(std::abs(wz), 1.0 / medium.ior)) {
                if (wz > 0.0)
                    return {};
                const double r = std::hypot(x, y);
                return {weight, r >= ring.inner && r < ring.outer ? weight : 0.0};
            }
            wz = -wz;
        }
        x += flight * wx;
        y += flight * wy;
        z += flight * wz;
        weight *= albedo;
        if (weight < 1e-3) {
            if (random.uniform() >= 0.1)
                return {};
            weight *= 10.0;
        }
        const double cos_theta = henyey_greenstein_sample(medium.g, random.uniform());
        const double sin_theta = std::sqrt(std::max(0.0, 1.0 - cos_theta * cos_theta));
        const double phi = 2.0 * pi * random.uniform();
        const double a = sin_theta * std::cos(phi);
        const double b = sin_theta * std::sin(phi);
        if (std::abs(wz) > 0.99999) {
            wx = a;
            wy = b;
            wz = std::copysign(cos_theta, wz);
        } else {
            const double s = std::sqrt(1.0 - wz * wz);
            const double old_x = wx, old_y = wy;
            wx = (a * old_x * wz - b * old_y) / s + old_x * cos_theta;
            wy = (a * old_y * wz + b * old_x) / s + old_y * cos_theta;
            wz = -a * s + wz * cos_theta;
        }
    }
}

Result ours(const Medium& medium, std::uint64_t seed, std::uint64_t photons, const std::string& kernel, int threads,
            bool calibrate = false)
{
    Progress progress;
    LdfLibrary library = simulate_library(medium, {angle_deg}, photons, seed, threads, kernel, progress);
    if (calibrate)
        library = calibrated(library, threads);
    const RadialProfile profile = library.profile(angle_deg, albedo, Side::reflected);
    const Ring ring = mid_range(medium);
    return {library.total(angle_deg, albedo, Side::reflected),
            2.0 * pi * (profile.cumulative(ring.outer)[0] - profile.cumulative(ring.inner)[0]),
            calibrate ? library.standard_error(angle_deg, albedo, Side::reflected) : 0.0};
}

struct Merit {
    Result mean;
    Result relative_error;  // of one photon
    Result merit;  // 1 / (variance x time), relative variance, seconds
    double photons_per_ms = 0.0;
};

double cpu_seconds()
{
    std::timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The median, because other programs only ever add time.
double median(std::vector<double> times)
{
    const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
    std::nth_element(times.begin(), middle, times.end());
    return *middle;
}

Merit merit_of(const Result& mean, const Result& relative_variance, std::uint64_t photons, double seconds)
{
    const auto n = static_cast<double>(photons);
    return {mean,
            {std::sqrt(relative_variance.total * n), std::sqrt(relative_variance.ring * n)},
            {1.0 / (relative_variance.total * seconds), 1.0 / (relative_variance.ring * seconds)},
            n / seconds / 1e3};
}

// Its photons are independent: the scatter between them tells the variance, more exactly than that between runs.
Merit measure_plain(const Medium& medium)
{
    constexpr std::uint64_t photons = 8000;  // of a run
    const double theta = refracted_angle(angle_deg * radians_per_degree, medium.ior);
    const double entered = 1.0 - fresnel(std::cos(angle_deg * radians_per_degree), medium.ior);
    const Ring ring = mid_range(medium);
    std::vector<double> times;
    Result sums, squares;
    for (std::uint64_t seed = 1; seed <= least_seeds; ++seed) {
        const double begin = cpu_seconds();
        Random random(seed, 0, 0);
        for (std::uint64_t i = 0; i < photons; ++i) {
            const Result one = plain_photon(medium, theta, ring, random);
            sums.total += one.total;
            sums.ring += one.ring;
            squares.total += one.total * one.total;
            squares.ring += one.ring * one.ring;
        }
        times.push_back(cpu_seconds() - begin);
    }
    const double n = static_cast<double>(photons) * least_seeds;
    const auto relative = [n](double sum, double square) {
        return (n * square / (sum * sum) - 1.0) / static_cast<double>(photons);
    };
    return merit_of({entered * sums.total / n, entered * sums.ring / n},
                    {relative(sums.total, squares.total), relative(sums.ring, squares.ring)}, photons, median(times));
}

Merit measure(std::uint64_t photons, const std::function<Result(std::uint64_t)>& run)
{
    std::vector<Result> results;
    std::vector<double> times;
    double all = 0.0;
    for (int seed = 1; seed <= least_seeds || (seed <= most_seeds && all < enough_seconds); ++seed) {
        const double begin = cpu_seconds();
        results.push_back(run(static_cast<std::uint64_t>(seed)));
        times.push_back(cpu_seconds() - begin);
        all += times.back();
    }
    const auto n = static_cast<double>(results.size());
    Result mean, relative;
    const auto of = [&](double Result::* part, double bias) {
        for (const Result& result : results)
            mean.*part += result.*part / n;
        double squares = bias * bias;
        for (const Result& result : results)
            squares += (result.*part - mean.*part) * (result.*part - mean.*part) / (n - 1.0);
        relative.*part = squares / (mean.*part * mean.*part);
    };
    of(&Result::total, results[0].bias);
    of(&Result::ring, 0.0);
    return merit_of(mean, relative, photons, median(times));
}

void print(const char* name, const Merit& merit, const Merit& base)
{
    std::printf("  %-11s %9.0f   %.5f  %7.4f  %8.1f x    %.5f  %5.2f  %6.1f x\n", name, merit.photons_per_ms,
                merit.mean.total, merit.relative_error.total, merit.merit.total / base.merit.total, merit.mean.ring,
                merit.relative_error.ring, merit.merit.ring / base.merit.ring);
    std::fflush(stdout);
}

double wall_seconds(const std::function<void()>& body)
{
    const auto begin = std::chrono::steady_clock::now();
    body();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

int main()
{
    std::printf(
        "albedo %g, %g degrees; error: relative, of one photon; FOM: 1 / (variance x CPU time) over the plain walk's.\n"
        "`calibrated` is what library() returns: the fastest walk, totals corrected by adding-doubling, whose time is\n"
        "counted and whose error, with interpolation's, stands for the total's; 200 000 photons, `final` those that library()\n"
        "takes for slabs, 4 million, and a million for half-spaces, which take as long for each however many there are\n",
        albedo, angle_deg);
    for (const Medium& medium :
         {Medium{0.8, 1.0}, Medium{0.8, 1.4}, Medium{0.0, 1.0}, Medium{0.95, 1.3}, Medium{0.8, 1.0, 10.0},
          Medium{0.8, 1.4, 1.0}}) {
        std::printf(
            "g %g, ior %g, thickness %g\n  walk        photon/ms    total    error        FOM       ring   error     "
            "FOM\n",
            medium.g, medium.ior, medium.thickness);
        const Merit base = measure_plain(medium);
        print("plain", base, base);
        const auto run = [&](const char* row, const std::string& kernel, std::uint64_t photons, bool calibrate) {
            print(
                row,
                measure(photons, [&](std::uint64_t seed) { return ours(medium, seed, photons, kernel, 1, calibrate); }),
                base);
        };
        for (const WalkKernel& kernel : walk_kernels())
            run(std::string(kernel.name).c_str(), std::string(kernel.name), kernel.name == "scalar" ? 8000 : 200000,
                false);
        run("calibrated", "", 200000, true);
        run("final", "", medium.is_half_space() ? 1000000 : 4000000, true);
    }
    const Medium medium{0.8, 1.4};
    const int cores = static_cast<int>(std::thread::hardware_concurrency());
    const double one = wall_seconds([&] { ours(medium, 1, 8000000, "", 1); });
    const double all = wall_seconds([&] { ours(medium, 1, 8000000, "", cores); });
    std::printf("%d threads are %.2f times as fast as one\n", cores, one / all);
}
