#include "ldf/library/ldf_library.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "base/constants.h"
#include "base/error.h"
#include "medium/medium.h"
#include "transport/exact/exact_totals.h"

namespace beamspread {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr auto bins = static_cast<Eigen::Index>(order_bin_count);
constexpr auto batches = static_cast<Eigen::Index>(batch_count);

// Number of observed totals: at every other compared albedo, and at an albedo of 1, where bounds are known.
constexpr std::size_t compared_count = compared_albedos.size();
constexpr Eigen::Index albedos = (compared_count + 1) / 2 + 1;

// Albedo that stands for 1 in the exact solution, which needs an albedo below 1. The difference is below its error.
constexpr double next_to_one = 1.0 - 1e-12;

// Albedo at which light has decayed to 1/e at the last scattering order of a walk.
constexpr double last_order_albedo = 1.0 - 1.0 / max_order;

// Photons per angle below which too many orders are empty for calibration.
constexpr std::uint64_t min_photons = 100;

// Newton's method below: rounds before giving up, smallest damping above 0 (over the largest curvature), and the
// squared Newton decrement (in squared tolerances) at which it ends. A larger end value: fewer rounds, less exact
// totals.
constexpr int max_rounds = 10'000;
constexpr double min_damping = 1e-9;
constexpr double settled = 1e-6;

// Absolute tolerance of totals, as a fraction of the light that enters. Larger: less exact totals where hardly any
// light leaves.
constexpr double negligible_power = 1e-9;

// Exact totals, [angle][albedo], of simulated angles and the middles between them, alternating; of the compared
// albedos, then `last_order_albedo` and `next_to_one`.
struct Exact {
    std::vector<double> angles_deg;
    ExactTotals totals;

    double total(std::size_t angle, std::size_t albedo, Side side) const
    {
        const std::size_t index = angle * (compared_count + 2) + albedo;
        return side == Side::reflected ? totals.reflectance[index] : totals.transmittance[index];
    }
};

Exact solve_exactly(const LdfLibrary& library, int threads)
{
    Exact exact{with_middles(library.angles_deg()), {}};
    std::vector<double> solved(compared_albedos.begin(), compared_albedos.end());
    solved.insert(solved.end(), {last_order_albedo, next_to_one});
    exact.totals = exact_totals(library.medium(), exact.angles_deg, solved, threads);
    return exact;
}

// Power of the bins in each batch, [bin][batch].
MatrixXd batch_powers(const SideResult& side)
{
    return Eigen::Map<const Eigen::MatrixXf>(side.batch_totals.data(), bins, batches).cast<double>();
}

// Relative variance of the mean power of each bin. A handful of photons reach the last orders and say little of their
// variance: no bin counts as better known than a bin before it.
VectorXd relative_variances(const MatrixXd& powers, const VectorXd& mean)
{
    const VectorXd variance = (powers.colwise() - mean).rowwise().squaredNorm() / (batches * (batches - 1));
    VectorXd relative = VectorXd::Zero(bins);
    double largest = 0.0;
    for (Eigen::Index b = 0; b < bins; ++b)
        if (mean(b) > 0.0) {
            largest = std::max(largest, variance(b) / (mean(b) * mean(b)));
            relative(b) = largest;
        }
    return relative;
}

// Observed totals, linear in the powers of the bins, with tolerances.
struct Observation {
    MatrixXd weights;    // [albedo][bin]
    VectorXd totals;     // [albedo]
    VectorXd tolerance;  // [albedo]
};

// Most likely non-negative scale of each bin's power, around 1 with this relative variance, given the totals. This is a
// quadratic programme with bounds. Its dual has one variable per total and is convex, smooth and piecewise quadratic.
// Newton's method solves it, damped (Marquardt 1963, doi:10.1137/0111030) by the Hessian with all bins free, which
// bounds the curvature of the dual: fully damped steps always descend.
VectorXd likeliest_scale(const VectorXd& power, const VectorXd& relative, const Observation& observed)
{
    const MatrixXd of_scale = observed.tolerance.cwiseInverse().asDiagonal() * observed.weights * power.asDiagonal();
    const VectorXd totals = observed.totals.cwiseQuotient(observed.tolerance);
    const auto scale_of = [&](const VectorXd& pull) -> VectorXd {
        return (VectorXd::Ones(bins) + relative.cwiseProduct(of_scale.transpose() * pull)).cwiseMax(0.0);
    };
    const auto dual = [&](const VectorXd& pull) {
        const VectorXd force = of_scale.transpose() * pull;
        const VectorXd scale = scale_of(pull);
        double sum = 0.5 * pull.squaredNorm() - totals.dot(pull);
        for (Eigen::Index b = 0; b < bins; ++b)
            if (relative(b) > 0.0)
                sum += scale(b) * force(b) - (scale(b) - 1.0) * (scale(b) - 1.0) / (2.0 * relative(b));
        return sum;
    };
    const auto hessian = [&](const VectorXd& free) {
        MatrixXd h = of_scale * free.asDiagonal() * of_scale.transpose();
        h.diagonal().array() += 1.0;
        return h;
    };
    const MatrixXd curvature_bound = hessian(relative);
    double damping = 0.0;
    VectorXd pull = VectorXd::Zero(albedos);
    VectorXd scale = VectorXd::Ones(bins);
    for (int round = 0; round < max_rounds; ++round) {
        const VectorXd gradient = of_scale * scale + pull - totals;
        VectorXd free = relative;
        for (Eigen::Index b = 0; b < bins; ++b)
            if (scale(b) <= 0.0)
                free(b) = 0.0;
        const MatrixXd curvature = hessian(free);
        const auto damped_step = [&]() -> VectorXd {
            return -(curvature + damping * curvature_bound).ldlt().solve(gradient);
        };
        if (!(gradient.dot(curvature.ldlt().solve(gradient)) > settled))
            break;
        const double here = dual(pull);
        damping = damping > min_damping ? 0.1 * damping : 0.0;
        VectorXd step = damped_step();
        while (damping < 1.0 && !(dual(pull + step) < here + 1e-4 * gradient.dot(step))) {
            damping = std::max(10.0 * damping, min_damping);
            step = damped_step();
        }
        pull += step;
        scale = scale_of(pull);
    }
    return scale;
}

// Scales the powers of a side's bins, and so their distributions, to the observed totals.
void calibrate(SideResult& side, const Observation& observed)
{
    MatrixXd powers = batch_powers(side);
    const VectorXd before = powers.rowwise().mean();
    const VectorXd relative = relative_variances(powers, before);
    const VectorXd scale = likeliest_scale(before, relative, observed);
    for (std::size_t row = 0; row < row_count; ++row) {
        const double factor = scale(static_cast<Eigen::Index>(order_bin_of(row)));
        float* power = side.power.data() + row * radius_bin_count;
        std::transform(power, power + radius_bin_count, power,
                       [factor](float x) { return static_cast<float>(factor * static_cast<double>(x)); });
    }
    // Scale each batch as if it were the whole simulation, to the same totals (update of its deviation: Kalman 1960, J.
    // Basic Eng. 82, 35). The mean of all batches stays.
    powers = scale.asDiagonal() * powers;
    const VectorXd variance = relative.cwiseProduct((scale.cwiseProduct(before)).cwiseAbs2());
    const MatrixXd spread = variance.asDiagonal() * observed.weights.transpose();
    MatrixXd innovation = observed.weights * spread;
    innovation.diagonal() += observed.tolerance.cwiseAbs2();
    const MatrixXd deviations = powers.colwise() - powers.rowwise().mean();
    powers -= spread * innovation.ldlt().solve(observed.weights * deviations);
    Eigen::Map<Eigen::MatrixXf>(side.batch_totals.data(), bins, batches) = powers.cast<float>();
}

}  // namespace

LdfLibrary calibrated(const LdfLibrary& library, int threads)
{
    const Medium& medium = library.medium();
    if (library.photons() < min_photons)
        reject("photons", static_cast<double>(library.photons()),
               "at least " + std::to_string(min_photons) + " per angle, or totals can't be made right");
    const Exact exact = solve_exactly(library, threads);
    const double relative_error = exact_totals_error(medium);
    std::vector<AngleResult> results = library.results();
    for (std::size_t j = 0; j < results.size(); ++j) {
        const double theta = results[j].angle_deg * radians_per_degree;
        const double entering = 1.0 - fresnel(std::cos(theta), medium.ior);
        for (const Side side : {Side::reflected, Side::transmitted}) {
            SideResult& result = results[j].sides[static_cast<std::size_t>(side)];
            if (result.power.empty())
                continue;
            const double ballistic = ballistic_total(medium, refracted_angle(theta, medium.ior), side);
            Observation observed{MatrixXd(albedos, bins), VectorXd(albedos), VectorXd(albedos)};
            const auto observe = [&](Eigen::Index row, double albedo, double total, double tolerance) {
                const auto weights = order_weights(result, albedo);
                observed.weights.row(row) = Eigen::Map<const VectorXd>(weights.data(), bins);
                observed.totals(row) = total - ballistic;
                observed.tolerance(row) = relative_error * total + negligible_power + tolerance;
            };
            for (std::size_t k = 0; k < compared_count; k += 2)
                observe(static_cast<Eigen::Index>(k / 2), compared_albedos[k], exact.total(2 * j, k, side) / entering,
                        0.0);
            // Observe the power of all orders: below the total at an albedo of 1, which includes light that leaves
            // later than any walk, and above that at `last_order_albedo` (a half-space, with n^-1/2 of the light inside
            // after n orders, is at .56 of the difference). The tolerance is half the distance to either bound. Without
            // this observation the last orders, which few photons reach, might return more light than arrives.
            const double upper = exact.total(2 * j, compared_count + 1, side) / entering;
            const double lower = exact.total(2 * j, compared_count, side) / entering;
            observe(albedos - 1, 1.0, 0.5 * (upper + lower), 0.25 * (upper - lower));
            calibrate(result, observed);
        }
    }

    const LdfLibrary result(medium, library.photons(), library.seed(), results);
    std::vector<SideResiduals> residuals(results.size(), SideResiduals{});
    for (std::size_t angle = 0; angle < exact.angles_deg.size(); ++angle)
        for (const Side side : {Side::reflected, Side::transmitted}) {
            Residuals& node = residuals[angle / 2][static_cast<std::size_t>(side)];
            auto& errors = angle % 2 == 0 ? node.here : node.halfway;
            for (std::size_t k = 0; k < errors.size(); ++k)
                if (const double total = exact.total(angle, k, side); total > 0.0)
                    errors[k] = static_cast<float>(
                        std::abs(result.total(exact.angles_deg[angle], compared_albedos[k], side) / total - 1.0));
        }
    return LdfLibrary(medium, library.photons(), library.seed(), std::move(results), std::move(residuals))
        .with_curved(library.curved());
}

}  // namespace beamspread
