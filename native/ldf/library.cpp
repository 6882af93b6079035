#include "ldf/library.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "medium/fresnel.h"
#include "transport/adding_doubling.h"

namespace beamspread {

namespace {

// Beyond the last simulated angle, if that is at least this close to grazing, its distribution is
// used with the exact Fresnel factor.
constexpr double grazing_deg = 88.0;

// Below this exponent a bin's weight is zero to any purpose, and the expansion in its variance no longer holds.
constexpr double negligible_log_weight = -60.0;

// Harmonics at the end of the row that move less than this part of a profile's power only cost time.
constexpr double negligible_harmonics = 1e-4;

// Weights of the harmonics of light so sharp that it needs more than are counted. Cut off, they would ring around rings
// with a peak, below zero beside it; fading out they do not, and texels finer than the last ones resolve are nearer to the
// truth. Around mirror images in thin slabs that was 1 % of all power below zero (g .9, ior 1.5, thickness .5, 80 degrees,
// texels of .05 mean free paths), and is 2e-5.
const std::array<double, harmonic_count>& fading_harmonics()
{
    static const std::array<double, harmonic_count> fading = [] {
        constexpr std::size_t half = harmonic_count / 2;
        std::array<double, harmonic_count> weights;
        weights.fill(1.0);
        for (std::size_t m = half; m < harmonic_count; ++m)
            weights[m] = 0.5 + 0.5 * std::cos(pi * static_cast<double>(m - half) / half);
        return weights;
    }();
    return fading;
}

// Sums over order bins [first, last), [harmonic][radius bin].
std::vector<double> contract_orders(const SideResult& side, const std::array<double, order_bin_count>& weights,
                                    std::size_t first, std::size_t last)
{
    std::vector<double> sums(most_harmonics(side) * radius_bin_count, 0.0);
    const float* ratios = side.ratios.data();
    for (std::size_t b = 0; b < order_bin_count; ++b) {
        const std::size_t harmonics = side.harmonics[b];
        if (b >= first && b < last && weights[b] != 0.0) {
            std::array<double, radius_bin_count> power;
            for (std::size_t k = 0; k < radius_bin_count; ++k) {
                power[k] = weights[b] * static_cast<double>(side.power[b * radius_bin_count + k]);
                sums[k] += power[k];
            }
            for (std::size_t m = 1; m < harmonics; ++m) {
                const double weight = harmonics == harmonic_count ? fading_harmonics()[m] : 1.0;
                for (std::size_t k = 0; k < radius_bin_count; ++k)
                    sums[m * radius_bin_count + k] +=
                        weight * power[k] * static_cast<double>(ratios[(m - 1) * radius_bin_count + k]);
            }
        }
        ratios += (harmonics - 1) * radius_bin_count;
    }
    return sums;
}

// From the sums over what is counted in all radius bins, and over what is counted in quarters of octaves.
struct OrderSums {
    OrderSums(const Medium& medium, const SideResult& side, double albedo) : centre(side.centre)
    {
        const auto weights = order_weights(side, albedo);
        const std::size_t fine_count = fine_orders(medium);
        if (fine_count > 0)
            fine = contract_orders(side, weights, 0, fine_count);
        quarters = contract_orders(side, weights, fine_count, order_bin_count);
    }

    RadialProfile profile() const
    {
        RadialProfile sum(centre, quarters, RadialDetail::quarters);
        if (!fine.empty())
            sum.add(RadialProfile(centre, fine, RadialDetail::all), 1.0, 1.0);
        sum.drop_negligible(negligible_harmonics);
        return sum;
    }

    double centre;
    std::vector<double> fine;
    std::vector<double> quarters;
};

// Relative deviations [harmonic][radius bin] of the powers of the rings, and of harmonics in parts of those.
void deviate(std::vector<double>& sums, const std::vector<double>& deviations)
{
    const bool fades = deviations.size() == harmonic_count * radius_bin_count;
    for (std::size_t i = sums.size(); i-- > 0;) {  // the powers, which come first, last
        const double weight = fades ? fading_harmonics()[i / radius_bin_count] : 1.0;
        sums[i] += weight * sums[i % radius_bin_count] * deviations[i];
    }
}

}  // namespace

std::array<double, order_bin_count> order_weights(const SideResult& side, double albedo)
{
    std::array<double, order_bin_count> weights{};
    if (albedo <= 0.0)
        return weights;
    const double log_albedo = std::log(albedo);
    for (std::size_t b = 1; b < order_bin_count; ++b) {
        const double log_weight = log_albedo * static_cast<double>(side.mean_order[b]);
        if (log_weight > negligible_log_weight)
            weights[b] =
                std::exp(log_weight + 0.5 * log_albedo * log_albedo * static_cast<double>(side.order_variance[b]));
    }
    return weights;
}

void check_albedo(double albedo)
{
    if (!(albedo >= 0.0 && albedo < 1.0))
        reject("albedo", albedo, "0 <= albedo < 1");
}

LdfLibrary::LdfLibrary(const Medium& medium, std::uint64_t photons, std::uint64_t seed,
                       std::vector<AngleResult> results, std::vector<SideResiduals> residuals)
    : m_medium(medium),
      m_photons(photons),
      m_seed(seed),
      m_results(std::move(results)),
      m_residuals(std::move(residuals))
{
    validate(medium);
    if (m_results.empty())
        reject("angles", "empty", "at least one angle");
    std::sort(m_results.begin(), m_results.end(),
              [](const AngleResult& a, const AngleResult& b) { return a.angle_deg < b.angle_deg; });
    if (is_calibrated() && m_residuals.size() != m_results.size())
        reject("residuals", static_cast<double>(m_residuals.size()), "as many as angles");
    // Outside the medium both the refracted angle and the Fresnel factor of light that comes back from a slab's other
    // boundary are smooth functions of the angle; inside, the latter turns up infinitely fast toward grazing.
    std::vector<double> nodes;
    for (const AngleResult& result : m_results) {
        const double node = result.angle_deg * radians_per_degree;
        // Closer nodes would only amplify the simulation's noise.
        if (!nodes.empty() && !(node - nodes.back() > 1e-3))
            reject("angles", result.angle_deg, "distinct angles, at least 0.1 degrees apart");
        nodes.push_back(node);
    }
    m_spline = AngleSpline(std::move(nodes));
}

std::vector<double> LdfLibrary::angles_deg() const
{
    std::vector<double> angles;
    for (const AngleResult& result : m_results)
        angles.push_back(result.angle_deg);
    return angles;
}

void LdfLibrary::check_angle(double angle_deg) const
{
    if (!(angle_deg >= 0.0 && angle_deg < 90.0))
        reject("angle", angle_deg, "0 <= angle < 90 degrees");
    constexpr double rounding = 1e-4;  // degrees: single-precision directions
    const double first = m_results.front().angle_deg;
    const double last = m_results.back().angle_deg;
    if (angle_deg < first - rounding || (angle_deg > last + rounding && last < grazing_deg)) {
        std::ostringstream span;
        span << first << " <= angle <= " << last << " degrees, what this library was simulated for";
        reject("angle", angle_deg, span.str());
    }
}

double LdfLibrary::clamped_angle(double angle_deg) const
{
    return std::clamp(angle_deg, m_results.front().angle_deg, m_results.back().angle_deg);
}

std::array<std::size_t, 2> LdfLibrary::neighbours(double angle_deg) const
{
    const double angle = clamped_angle(angle_deg);
    std::size_t j = 0;
    while (j + 2 < m_results.size() && angle >= m_results[j + 1].angle_deg)
        ++j;
    return {j, std::min(j + 1, m_results.size() - 1)};
}

double LdfLibrary::entry_transmittance(double angle_deg) const
{
    return 1.0 - fresnel(std::cos(angle_deg * radians_per_degree), m_medium.ior);
}

LdfLibrary::AngleWeights LdfLibrary::angle_weights(double angle_deg) const
{
    check_angle(angle_deg);
    const double theta = clamped_angle(angle_deg) * radians_per_degree;
    const double transmittance = entry_transmittance(angle_deg);
    AngleWeights weights{m_spline.weights(theta, AngleSpline::Parity::even),
                         m_spline.weights(theta, AngleSpline::Parity::odd), neighbours(angle_deg)};
    for (double& w : weights.even)
        w *= transmittance;
    for (double& w : weights.odd)
        w *= transmittance;
    return weights;
}

double LdfLibrary::total(double angle_deg, double albedo, Side side) const
{
    check_albedo(albedo);
    const AngleWeights weights = angle_weights(angle_deg);
    double sum = entry_transmittance(angle_deg) *
                 ballistic_total(m_medium, refracted_angle(angle_deg * radians_per_degree, m_medium.ior), side);
    for (std::size_t j = 0; j < m_results.size(); ++j) {
        const SideResult& result = m_results[j].sides[static_cast<std::size_t>(side)];
        if (result.power.empty())
            continue;
        const auto by_order = order_weights(result, albedo);
        double scattered = 0.0;
        for (std::size_t i = 0; i < result.batch_totals.size(); ++i)
            scattered += by_order[i % order_bin_count] * static_cast<double>(result.batch_totals[i]);
        sum += weights.even[j] * scattered / static_cast<double>(batch_count);
    }
    return sum;
}

double LdfLibrary::standard_error(double angle_deg, double albedo, Side side) const
{
    check_albedo(albedo);
    const AngleWeights weights = angle_weights(angle_deg);
    double variance = 0.0;  // angles are simulated independently
    for (std::size_t j = 0; j < m_results.size(); ++j) {
        const SideResult& result = m_results[j].sides[static_cast<std::size_t>(side)];
        if (result.power.empty())
            continue;
        const auto by_order = order_weights(result, albedo);
        std::array<double, batch_count> totals{};
        for (std::size_t i = 0; i < result.batch_totals.size(); ++i)
            totals[i / order_bin_count] += by_order[i % order_bin_count] * static_cast<double>(result.batch_totals[i]);
        double mean = 0.0;
        for (double t : totals)
            mean += t / static_cast<double>(batch_count);
        double squares = 0.0;
        for (double t : totals)
            squares += (t - mean) * (t - mean);
        variance += weights.even[j] * weights.even[j] * squares / static_cast<double>(batch_count * (batch_count - 1));
    }
    if (is_calibrated()) {
        const double relative = std::hypot(exact_totals_error(m_medium), residual(angle_deg, albedo, side));
        variance += std::pow(relative * total(angle_deg, albedo, side), 2);
    }
    return std::sqrt(variance);
}

// The largest of those at the compared angles and albedos around.
double LdfLibrary::residual(double angle_deg, double albedo, Side side) const
{
    const double angle = clamped_angle(angle_deg);
    const auto s = static_cast<std::size_t>(side);
    const auto above = std::upper_bound(compared_albedos.begin(), compared_albedos.end() - 1, albedo);
    const auto k = static_cast<std::size_t>(above - compared_albedos.begin());
    const auto at = [k](const auto& values) { return std::max(values[k == 0 ? 0 : k - 1], values[k]); };
    std::size_t j = 0;
    while (j + 1 < m_results.size() && angle >= m_results[j + 1].angle_deg)
        ++j;
    const Residuals& from = m_residuals[j][s];
    if (angle == m_results[j].angle_deg || j + 1 == m_results.size())
        return static_cast<double>(at(from.here));
    const bool is_near = 2.0 * angle < m_results[j].angle_deg + m_results[j + 1].angle_deg;
    return static_cast<double>(std::max(at(from.halfway), at(is_near ? from.here : m_residuals[j + 1][s].here)));
}

double LdfLibrary::diffuse_reflectance(double albedo) const
{
    // 2 integral of R(mu) mu dmu by midpoints, exact to 1e-4: in mu, because R may grow linearly with it at grazing.
    constexpr int points = 64;
    double sum = 0.0;
    for (int i = 0; i < points; ++i) {
        const double mu = (i + 0.5) / points;
        sum += 2.0 * mu * total(std::acos(mu) / radians_per_degree, albedo, Side::reflected);
    }
    return sum / points;
}

std::vector<RadialProfile> LdfLibrary::node_profiles(double albedo, Side side) const
{
    check_albedo(albedo);
    std::vector<RadialProfile> profiles;
    for (const AngleResult& result : m_results) {
        const SideResult& from = result.sides[static_cast<std::size_t>(side)];
        profiles.push_back(from.power.empty() ? RadialProfile() : OrderSums(m_medium, from, albedo).profile());
    }
    return profiles;
}

RadialProfile LdfLibrary::interpolated(double angle_deg, const std::vector<RadialProfile>& nodes) const
{
    const AngleWeights weights = angle_weights(angle_deg);
    RadialProfile sum;
    double centre = 0.0;
    for (std::size_t j = 0; j < nodes.size(); ++j) {
        sum.add(nodes[j], weights.even[j], weights.odd[j]);
        centre += weights.odd[j] * nodes[j].centre();
    }
    // The weights hold the transmittance at entry, which changes power and no place.
    sum.set_centre(centre / entry_transmittance(angle_deg));
    sum.keep_harmonics(weights.harmonics(nodes));
    sum.drop_negligible(negligible_harmonics);
    return sum;
}

RadialProfile LdfLibrary::profile(double angle_deg, double albedo, Side side) const
{
    return interpolated(angle_deg, node_profiles(albedo, side));
}

RadialProfile LdfLibrary::group_profile(double angle_deg, double albedo, Side side, std::size_t group) const
{
    check_albedo(albedo);
    std::vector<RadialProfile> nodes;
    for (const AngleResult& result : m_results) {
        const SideResult& from = result.sides[static_cast<std::size_t>(side)];
        if (from.power.empty()) {
            nodes.emplace_back();
            continue;
        }
        const std::vector<double> deviations = deviations_at(m_medium, from.deviations, from.radii, group, albedo);
        OrderSums sums(m_medium, from, albedo);
        deviate(sums.fine, deviations);
        deviate(sums.quarters, deviations);
        nodes.push_back(sums.profile());
    }
    return interpolated(angle_deg, nodes);
}

std::vector<BallisticExit> LdfLibrary::ballistic(double angle_deg, Side side) const
{
    check_angle(angle_deg);
    auto exits = ballistic_exits(m_medium, refracted_angle(angle_deg * radians_per_degree, m_medium.ior), side);
    for (BallisticExit& exit : exits)
        exit.power *= entry_transmittance(angle_deg);
    return exits;
}

LdfLibrary simulate_library(const Medium& medium, const std::vector<double>& angles_deg, std::uint64_t photons,
                            std::uint64_t seed, int threads, std::string_view kernel, Progress& progress)
{
    // Checked before the work, though the library checks again.
    std::vector<double> sorted = angles_deg;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
        reject("angles", *std::adjacent_find(sorted.begin(), sorted.end()), "distinct angles");
    auto results = simulate(medium, sorted, photons, seed, threads, kernel, progress);
    return LdfLibrary(medium, photons, seed, std::move(results));
}

}  // namespace beamspread
