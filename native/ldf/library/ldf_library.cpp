#include "ldf/library/ldf_library.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"
#include "ldf/radial/radial_function.h"
#include "ldf/radial/radial_profile.h"
#include "medium/medium.h"

namespace beamspread {

namespace {

// Angle in degrees from which the last simulated distribution, with the exact Fresnel factor, serves all larger angles.
// Larger: smaller errors near grazing, but libraries must reach this angle.
constexpr double grazing_deg = 88.0;

// Thickness, mean free paths, up to which light leaves the far side of a slab so sharply that profiles around the entry
// need nodes four times as close as the simulated angles, in place of twice. Larger: smaller errors, more time.
constexpr double max_sharp_exit = 4.0;

// Fraction of a profile's power that its dropped trailing harmonics may move. Larger: less time, larger errors.
constexpr double negligible_harmonics = 1e-4;

// Sums over the rows of a pole, weighted for an albedo, [harmonic][radius bin].
std::vector<double> contract_orders(const SideResult& side, double albedo, std::size_t pole)
{
    const std::array<double, order_bin_count> weights = order_weights(side, albedo);
    std::vector<double> sums(max_harmonics(side.harmonics, pole) * radius_bin_count, 0.0);
    const float* ratios = side.ratios.data();
    for (std::size_t row = 0; row < end_row(pole); ++row) {
        const std::size_t harmonics = side.harmonics[row];
        const double order_weight = weights[order_bin_of(row)];
        if (row >= first_row(pole) && order_weight != 0.0) {
            std::array<double, radius_bin_count> power;
            for (std::size_t k = 0; k < radius_bin_count; ++k) {
                power[k] = order_weight * static_cast<double>(side.power[row * radius_bin_count + k]);
                sums[k] += power[k];
            }
            for (std::size_t m = 1; m < harmonics; ++m) {
                const double weight = harmonics == harmonic_count ? harmonic_taper()[m] : 1.0;
                for (std::size_t k = 0; k < radius_bin_count; ++k)
                    sums[m * radius_bin_count + k] +=
                        weight * power[k] * static_cast<double>(ratios[(m - 1) * radius_bin_count + k]);
            }
        }
        ratios += (harmonics - 1) * radius_bin_count;
    }
    return sums;
}

// Adds a group's deviations, [harmonic][radius bin], which are relative to the rings' powers.
void deviate(std::vector<double>& sums, const std::vector<double>& deviations)
{
    const bool fades = deviations.size() == harmonic_count * radius_bin_count;
    for (std::size_t i = sums.size(); i-- > 0;) {  // backward: the powers at the front change last
        const double weight = fades ? harmonic_taper()[i / radius_bin_count] : 1.0;
        sums[i] += weight * sums[i % radius_bin_count] * deviations[i];
    }
}

std::size_t used_poles(const Medium& medium)
{
    return mirrored_orders(medium) == 0 ? 1 : pole_count;
}

}  // namespace

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
    std::vector<double> angles;
    for (const AngleResult& result : m_results)
        angles.push_back(result.angle_deg);
    m_simulated = AngleNodes(std::move(angles));
    // Displaced poles move from node to node, hence profiles around the entry need closer nodes.
    const AngleNodes closer(with_middles(angles_deg()));
    const bool has_sharp_exit = medium.thickness <= max_sharp_exit;
    m_nodes = {used_poles(medium) > 1 ? closer : m_simulated,
               has_sharp_exit ? AngleNodes(with_middles(closer.angles_deg())) : closer};
}

void LdfLibrary::check_angle(double angle_deg) const
{
    if (!(angle_deg >= 0.0 && angle_deg < 90.0))
        reject("angle", angle_deg, "0 <= angle < 90 degrees");
    constexpr double rounding = 1e-4;  // degrees; error of directions in single precision
    const double first = m_results.front().angle_deg;
    const double last = m_results.back().angle_deg;
    if (angle_deg < first - rounding || (angle_deg > last + rounding && last < grazing_deg)) {
        std::ostringstream span;
        span << first << " <= angle <= " << last << " degrees, the angles that this library was simulated for";
        reject("angle", angle_deg, span.str());
    }
}

void LdfLibrary::check_side(Side side) const
{
    if (side == Side::transmitted && m_medium.is_half_space())
        reject("side", "'transmitted'", "'reflected' for LDFs of a half-space, which has no far side");
}

double LdfLibrary::entry_transmittance(double angle_deg) const
{
    return 1.0 - fresnel(std::cos(angle_deg * radians_per_degree), m_medium.ior);
}

LdfLibrary::AngleWeights LdfLibrary::angle_weights(double angle_deg, Side side) const
{
    check_angle(angle_deg);
    return m_nodes[static_cast<std::size_t>(side)].weights(angle_deg, entry_transmittance(angle_deg));
}

LdfLibrary::AngleWeights LdfLibrary::simulated_weights(double angle_deg) const
{
    check_angle(angle_deg);
    return m_simulated.weights(angle_deg, entry_transmittance(angle_deg));
}

std::vector<LdfLibrary::PoleProfiles> LdfLibrary::simulated_profiles(double albedo, Side side,
                                                                     std::optional<std::size_t> group,
                                                                     RadialEnd end) const
{
    check_albedo(albedo);
    std::vector<PoleProfiles> poles(used_poles(m_medium));
    for (std::size_t pole = 0; pole < poles.size(); ++pole)
        for (const AngleResult& result : m_results) {
            RadialProfile& profile = poles[pole].emplace_back();
            const SideResult& from = result.sides[static_cast<std::size_t>(side)];
            if (from.power.empty())
                continue;
            std::vector<double> sums = contract_orders(from, albedo, pole);
            if (group)
                deviate(sums, deviations_at(from.deviations, from.harmonics, from.radii, *group, pole, albedo));
            profile = RadialProfile(0.0, sums, RadialDetail::bins, end);
            profile.drop_negligible(negligible_harmonics);
        }
    return poles;
}

RadialProfile LdfLibrary::interpolated(double angle_deg, Side side, std::size_t pole, const PoleProfiles& nodes,
                                       const AngleWeights& weights) const
{
    RadialProfile sum;
    for (std::size_t j = 0; j < nodes.size(); ++j)
        sum.add(nodes[j], weights.even[j], weights.odd[j]);
    const double theta = refracted_angle(m_simulated.clamped(angle_deg) * radians_per_degree, m_medium.ior);
    sum.set_centre(pole_positions(m_medium, theta)[static_cast<std::size_t>(side)][pole]);
    sum.keep_harmonics(weights.harmonics(nodes));
    sum.drop_negligible(negligible_harmonics);
    return sum;
}

std::vector<RadialProfile> LdfLibrary::node_profiles(double albedo, Side side) const
{
    const std::vector<PoleProfiles> poles = simulated_profiles(albedo, side);
    if (poles.size() == 1 && side == Side::reflected)
        return poles.front();
    const AngleNodes& nodes = m_nodes[static_cast<std::size_t>(side)];
    std::vector<RadialProfile> profiles(nodes.count());
    parallel_for(profiles.size(), [&](std::size_t j) {
        const double angle = nodes.angles_deg()[j];
        const AngleWeights weights = m_simulated.weights(angle, 1.0);
        for (std::size_t pole = 0; pole < poles.size(); ++pole)
            profiles[j].add(recentred(interpolated(angle, side, pole, poles[pole], weights), 0.0), 1.0, 1.0);
        profiles[j].drop_negligible(negligible_harmonics);
    });
    return profiles;
}

RadialProfile LdfLibrary::profile(double angle_deg, double albedo, Side side) const
{
    RadialProfile sum = interpolated(angle_deg, side, 0, node_profiles(albedo, side), angle_weights(angle_deg, side));
    sum.set_centre(0.0);
    return sum;
}

std::vector<RadialProfile> LdfLibrary::pole_profiles(double angle_deg, double albedo, Side side,
                                                     std::optional<std::size_t> group) const
{
    const AngleWeights weights = simulated_weights(angle_deg);
    const std::vector<PoleProfiles> poles = simulated_profiles(albedo, side, group);
    std::vector<RadialProfile> profiles;
    for (std::size_t pole = 0; pole < poles.size(); ++pole)
        profiles.push_back(interpolated(angle_deg, side, pole, poles[pole], weights));
    return profiles;
}

std::vector<BallisticExit> LdfLibrary::ballistic(double angle_deg, Side side) const
{
    check_angle(angle_deg);
    auto exits = ballistic_exits(m_medium, refracted_angle(angle_deg * radians_per_degree, m_medium.ior), side);
    for (BallisticExit& exit : exits)
        exit.power *= entry_transmittance(angle_deg);
    return exits;
}

}  // namespace beamspread
