// Libraries of curved surfaces inside a library.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"
#include "ldf/library/ldf_library.h"

namespace beamspread {

namespace {

// Fraction of the light that enters below which an exit of the unscattered beam is left out. Larger: larger errors.
constexpr double negligible_exit = 1e-5;

// Number of harmonics of an exit. Sums over square grids of samples don't resolve more: the neighbours of a sample lie at
// the maxima of cos(4 phi).
constexpr std::size_t exit_harmonics = 4;

}  // namespace

LdfLibrary LdfLibrary::with_curved(std::vector<CurvedPart> parts) const
{
    std::sort(parts.begin(), parts.end(),
              [](const CurvedPart& a, const CurvedPart& b) { return a.curvature < b.curvature; });
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const bool repeats = i > 0 && !(parts[i].curvature > parts[i - 1].curvature);
        if (repeats || parts[i].curvature == 0.0 || !std::isfinite(parts[i].curvature))
            reject("curvatures", parts[i].curvature, "distinct curvatures per mean free path");
        if (parts[i].library->medium() != m_medium)
            reject("curvatures", parts[i].curvature, "libraries of the same medium");
    }
    LdfLibrary copy = *this;
    copy.m_curved = std::move(parts);
    return copy;
}

std::vector<double> LdfLibrary::curvatures() const
{
    std::vector<double> all = {0.0};
    for (const CurvedPart& part : m_curved)
        all.push_back(part.curvature);
    std::sort(all.begin(), all.end());
    return all;
}

const CurvedPart* LdfLibrary::curved_part(std::size_t curvature) const
{
    const double value = curvatures().at(curvature);
    const auto part = std::find_if(m_curved.begin(), m_curved.end(),
                                   [value](const CurvedPart& candidate) { return candidate.curvature == value; });
    return part == m_curved.end() ? nullptr : &*part;
}

std::array<LdfLibrary::CurvatureWeight, 2> LdfLibrary::curvature_weights(double curvature) const
{
    const std::vector<double> nodes = curvatures();
    if (!(curvature >= nodes.front() && curvature <= nodes.back())) {
        std::ostringstream span;
        span << nodes.front() << " <= curvature <= " << nodes.back()
             << " per mean free path, the curvatures that this library was simulated for";
        reject("curvature", curvature, span.str());
    }
    const auto above = std::upper_bound(nodes.begin(), nodes.end(), curvature);
    const auto low = static_cast<std::size_t>(above - nodes.begin()) - 1;
    const std::size_t high = std::min(low + 1, nodes.size() - 1);
    const double weight = high > low ? (curvature - nodes[low]) / (nodes[high] - nodes[low]) : 0.0;
    return {CurvatureWeight{low, 1.0 - weight}, CurvatureWeight{high, weight}};
}

LdfLibrary::SplitWeights LdfLibrary::split_weights(const AngleWeights& weights, const LdfLibrary& part) const
{
    // With P the plane's and K the part's values, the value at the plane's angle j is
    // P_j + sum_i w_ij (K_i - sum_l v_li P_l): w interpolates between the part's angles i, v between the plane's.
    const std::size_t count = part.m_simulated.count();
    SplitWeights split{weights, {std::vector<double>(count), std::vector<double>(count), {0, count - 1}}};
    for (std::size_t j = 0; j < m_simulated.count(); ++j) {
        const AngleWeights at_angle = part.m_simulated.weights(angles_deg()[j], 1.0);
        for (std::size_t i = 0; i < count; ++i) {
            split.part.even[i] += weights.even[j] * at_angle.even[i];
            split.part.odd[i] += weights.odd[j] * at_angle.odd[i];
        }
    }
    for (std::size_t i = 0; i < count; ++i) {
        const AngleWeights at_angle = m_simulated.weights(part.angles_deg()[i], 1.0);
        for (std::size_t l = 0; l < m_simulated.count(); ++l) {
            split.plane.even[l] -= split.part.even[i] * at_angle.even[l];
            split.plane.odd[l] -= split.part.odd[i] * at_angle.odd[l];
        }
    }
    return split;
}

void LdfLibrary::add_unscattered(std::vector<RadialProfile>& profiles, Side side) const
{
    const std::vector<double>& angles = m_nodes[static_cast<std::size_t>(side)].angles_deg();
    const auto exits_at = [&](double angle_deg) {
        return ballistic_exits(m_medium, refracted_angle(angle_deg * radians_per_degree, m_medium.ior), side);
    };
    for (std::size_t j = 0; j < angles.size(); ++j) {
        const auto nearest = exits_at(0.5 * (angles[j] + angles[j == 0 ? 0 : j - 1]));
        const auto farthest = exits_at(0.5 * (angles[j] + angles[std::min(j + 1, angles.size() - 1)]));
        const auto exits = exits_at(angles[j]);
        for (std::size_t k = 0; k < std::min({nearest.size(), exits.size(), farthest.size()}); ++k)
            if (exits[k].power >= negligible_exit) {
                RadialProfile exit = on_axis(nearest[k].u, farthest[k].u, exits[k].power);
                exit.keep_harmonics(exit_harmonics);
                profiles[j].add(exit, 1.0, 1.0);
            }
    }
}

std::vector<RadialProfile> LdfLibrary::curved_node_profiles(double albedo, Side side, std::size_t curvature) const
{
    const CurvedPart* part = curved_part(curvature);
    if (!part) {
        std::vector<RadialProfile> flat = node_profiles(albedo, side);
        add_unscattered(flat, side);
        return flat;
    }
    const RadialEnd end = part->curvature > 0.0 ? RadialEnd::abrupt : RadialEnd::faded;
    const std::vector<RadialProfile> curved = part->library->simulated_profiles(albedo, side, {}, end).front();
    if (part->library->angles_deg() == angles_deg())
        return curved;
    const std::vector<RadialProfile> plane = node_profiles(albedo, side);
    std::vector<RadialProfile> profiles(plane.size());
    parallel_for(profiles.size(), [&](std::size_t j) {
        AngleWeights here{std::vector<double>(plane.size()), std::vector<double>(plane.size()), {j, j}};
        here.even[j] = here.odd[j] = 1.0;
        const auto [of_plane, of_part] = split_weights(here, *part->library);
        for (std::size_t l = 0; l < plane.size(); ++l)
            profiles[j].add(plane[l], of_plane.even[l], of_plane.odd[l]);
        for (std::size_t i = 0; i < curved.size(); ++i)
            profiles[j].add(curved[i], of_part.even[i], of_part.odd[i]);
        const auto around = part->library->m_simulated.neighbours(angles_deg()[j]);
        profiles[j].keep_harmonics(
            std::max({plane[j].harmonics(), curved[around[0]].harmonics(), curved[around[1]].harmonics()}));
    });
    return profiles;
}

RadialProfile LdfLibrary::curved_profile(double angle_deg, double albedo, Side side, double curvature) const
{
    const AngleWeights weights = angle_weights(angle_deg, side);
    RadialProfile sum;
    for (const CurvatureWeight& node : curvature_weights(curvature))
        if (node.weight != 0.0)
            sum.add(interpolated(angle_deg, side, 0, curved_node_profiles(albedo, side, node.index), weights),
                    node.weight, node.weight);
    return sum;
}

double LdfLibrary::total(double angle_deg, double albedo, Side side, double curvature) const
{
    check_albedo(albedo);
    const AngleWeights weights = simulated_weights(angle_deg);
    double sum = 0.0;
    for (const CurvatureWeight& node : curvature_weights(curvature)) {
        const CurvedPart* part = curved_part(node.index);
        if (node.weight == 0.0)
            continue;
        if (!part) {
            sum += node.weight * total(angle_deg, albedo, side);
            continue;
        }
        const auto s = static_cast<std::size_t>(side);
        const auto [of_plane, of_part] = split_weights(weights, *part->library);
        for (std::size_t l = 0; l < m_results.size(); ++l)
            sum += node.weight * of_plane.even[l] * scattered_total(m_results[l].sides[s], albedo);
        for (std::size_t i = 0; i < of_part.even.size(); ++i)
            sum += node.weight * of_part.even[i] * scattered_total(part->library->results()[i].sides[s], albedo);
    }
    return sum;
}

double LdfLibrary::standard_error(double angle_deg, double albedo, Side side, double curvature) const
{
    const auto curvatures_around = curvature_weights(curvature);
    if (curvature == 0.0)
        return standard_error(angle_deg, albedo, side);
    check_albedo(albedo);
    const AngleWeights weights = simulated_weights(angle_deg);
    double variance = 0.0;
    for (const CurvatureWeight& node : curvatures_around) {
        const CurvedPart* part = curved_part(node.index);
        if (!part) {
            variance += std::pow(node.weight * standard_error(angle_deg, albedo, side), 2);
            continue;
        }
        const LdfLibrary& library = *part->library;
        const auto [of_plane, of_part] = split_weights(weights, library);
        double of_node = statistical_variance(of_plane, albedo, side);
        for (std::size_t i = 0; i < of_part.even.size(); ++i) {
            const SideResult& result = library.results()[i].sides[static_cast<std::size_t>(side)];
            const double relative = library.residual(library.angles_deg()[i], albedo, side);
            of_node += std::pow(of_part.even[i] * relative * scattered_total(result, albedo), 2);
        }
        variance += node.weight * node.weight * of_node;
    }
    return std::sqrt(variance);
}

}  // namespace beamspread
