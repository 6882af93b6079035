#include "ldf/library/ldf_library.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "medium/medium.h"
#include "transport/exact/exact_totals.h"

namespace beamspread {

namespace {

// Exponent below which a bin's weight is zero; the expansion in its variance no longer holds there.
constexpr double negligible_log_weight = -60.0;

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

double scattered_total(const SideResult& side, double albedo)
{
    const auto by_order = order_weights(side, albedo);
    double sum = 0.0;
    for (std::size_t i = 0; i < side.batch_totals.size(); ++i)
        sum += by_order[i % order_bin_count] * static_cast<double>(side.batch_totals[i]);
    if (!side.batch_totals.empty())
        return sum / static_cast<double>(batch_count);
    for (std::size_t i = 0; i < side.power.size(); ++i)
        sum += by_order[order_bin_of(i / radius_bin_count)] * static_cast<double>(side.power[i]);
    return sum;
}

double LdfLibrary::total(double angle_deg, double albedo, Side side) const
{
    check_albedo(albedo);
    const AngleWeights weights = simulated_weights(angle_deg);
    double sum = entry_transmittance(angle_deg) *
                 ballistic_total(m_medium, refracted_angle(angle_deg * radians_per_degree, m_medium.ior), side);
    for (std::size_t j = 0; j < m_results.size(); ++j) {
        const SideResult& result = m_results[j].sides[static_cast<std::size_t>(side)];
        if (result.power.empty())
            continue;
        sum += weights.even[j] * scattered_total(result, albedo);
    }
    return sum;
}

double LdfLibrary::standard_error(double angle_deg, double albedo, Side side) const
{
    check_albedo(albedo);
    double variance = statistical_variance(simulated_weights(angle_deg), albedo, side);
    if (is_calibrated()) {
        const double relative = std::hypot(exact_totals_error(m_medium), residual(angle_deg, albedo, side));
        variance += std::pow(relative * total(angle_deg, albedo, side), 2);
    }
    return std::sqrt(variance);
}

double LdfLibrary::statistical_variance(const AngleWeights& weights, double albedo, Side side) const
{
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
    return variance;
}

// Largest remaining error at the compared angles and albedos around.
double LdfLibrary::residual(double angle_deg, double albedo, Side side) const
{
    const double angle = m_simulated.clamped(angle_deg);
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
    // Compute 2 integral of R(mu) mu dmu by the midpoint rule in mu, as R may be linear in mu at grazing.
    constexpr int points = 64;  // more: smaller errors, more time
    double sum = 0.0;
    for (int i = 0; i < points; ++i) {
        const double mu = (i + 0.5) / points;
        sum += 2.0 * mu * total(std::acos(mu) / radians_per_degree, albedo, Side::reflected);
    }
    return sum / points;
}

}  // namespace beamspread
