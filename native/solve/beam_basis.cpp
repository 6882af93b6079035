#include "solve/beam_basis.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/constants.h"

namespace beamspread {

namespace {

struct AngleRange {
    double first = 90.0;
    double last = 0.0;
};

AngleRange range_of_lit_beams(const Problem& problem)
{
    AngleRange range;
    for (std::size_t y = 0; y < problem.height; ++y)
        for (std::size_t x = 0; x < problem.width; ++x) {
            bool lit = false;
            for (const Channel& channel : problem.channels)
                lit = lit || channel.irradiance(y, x) > 0.0f;
            if (!lit)
                continue;
            const double angle = incidence_deg(direction_at(problem, y, x));
            range.first = std::min(range.first, angle);
            range.last = std::max(range.last, angle);
        }
    return range;
}

std::vector<double> chebyshev_nodes(const AngleRange& range, std::size_t count)
{
    std::vector<double> nodes(count);
    for (std::size_t k = 0; k < count; ++k) {
        const double x = count == 1 ? 0.0 : std::cos(pi * static_cast<double>(k) / static_cast<double>(count - 1));
        nodes[k] = 0.5 * (range.first + range.last) + 0.5 * (range.last - range.first) * x;
    }
    return nodes;
}

std::vector<double> lagrange_weights(const std::vector<double>& nodes, double x)
{
    std::vector<double> weights(nodes.size(), 1.0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (std::size_t k = 0; k < nodes.size(); ++k)
            if (k != i)
                weights[i] *= (x - nodes[k]) / (nodes[i] - nodes[k]);
    return weights;
}

// Upper bounds of the L1 norm of each harmonic, relative to the profile's power: the radial integral of |c_m|
// over bins, times that of |cos(m phi)|.
Harmonics relative_norms(const RadialProfile& profile, double power)
{
    Harmonics norms{};
    Harmonics previous{};
    for (std::size_t k = 0; k < radius_bin_count; ++k) {
        const Harmonics cumulative = profile.cumulative(radius_bin_edge(k));
        for (std::size_t m = 0; m < harmonic_count; ++m)
            norms[m] += (m == 0 ? 2.0 * pi : 4.0) * std::abs(cumulative[m] - previous[m]);
        previous = cumulative;
    }
    for (double& norm : norms)
        norm = power > 0.0 ? norm / power : 0.0;
    return norms;
}

// L1 distance of two profiles, relative to the first one's power.
double distance(const RadialProfile& a, const RadialProfile& b)
{
    RadialProfile difference = a;
    difference.add(b, -1.0, -1.0);
    const Harmonics norms = relative_norms(difference, a.total());
    return std::accumulate(norms.begin(), norms.end(), 0.0);
}

RadialProfile combine(const std::vector<RadialProfile>& nodes, const std::vector<double>& weights)
{
    RadialProfile sum;
    for (std::size_t j = 0; j < nodes.size(); ++j)
        sum.add(nodes[j], weights[j], weights[j]);
    return sum;
}

}  // namespace

double incidence_deg(const Vec3& direction)
{
    return std::atan2(std::hypot(direction.x, direction.y), -direction.z) / radians_per_degree;
}

double azimuth(const Vec3& direction)
{
    return std::atan2(direction.y, direction.x);
}

Vec3 direction_at(const Problem& problem, std::size_t y, std::size_t x)
{
    if (!problem.directions.field)
        return problem.directions.uniform;
    const float* d = problem.directions.field + 3 * (y * problem.width + x);
    return Vec3(d[0], d[1], d[2]);
}

std::vector<std::size_t> needed_harmonics(const std::vector<std::vector<RadialProfile>>& profiles, double tolerance)
{
    Harmonics strongest{};
    for (const std::vector<RadialProfile>& channel : profiles) {
        for (const RadialProfile& profile : channel) {
            const Harmonics norms = relative_norms(profile, profile.total());
            for (std::size_t m = 0; m < harmonic_count; ++m)
                strongest[m] = std::max(strongest[m], norms[m]);
        }
    }
    std::vector<std::size_t> weakest_first(harmonic_count);
    std::iota(weakest_first.begin(), weakest_first.end(), std::size_t{0});
    std::sort(weakest_first.begin(), weakest_first.end(),
              [&](std::size_t a, std::size_t b) { return strongest[a] < strongest[b]; });
    double left_out = 0.0;
    std::size_t count = 0;
    while (count < harmonic_count && left_out + strongest[weakest_first[count]] < tolerance)
        left_out += strongest[weakest_first[count++]];
    std::vector<std::size_t> needed(weakest_first.begin() + static_cast<std::ptrdiff_t>(count), weakest_first.end());
    std::sort(needed.begin(), needed.end());
    return needed;
}

BeamBasis BeamBasis::uniform(const Problem& problem)
{
    BeamBasis basis;
    basis.m_node_count = 1;
    const double angle = incidence_deg(problem.directions.uniform);
    basis.m_profiles = [angle](const Channel& channel) {
        return std::vector{channel.library->profile(angle, channel.albedo, Side::reflected)};
    };
    basis.m_weights = [](const Vec3&) { return Weights{{1.0}, {1.0}}; };
    return basis;
}

BeamBasis BeamBasis::library_nodes(const LdfLibrary& library)
{
    BeamBasis basis;
    basis.m_node_count = library.results().size();
    basis.m_profiles = [](const Channel& channel) {
        return channel.library->node_profiles(channel.albedo, Side::reflected);
    };
    basis.m_weights = [&library](const Vec3& direction) { return library.angle_weights(incidence_deg(direction)); };
    return basis;
}

BeamBasis BeamBasis::present_angles(const Problem& problem, const Channel& channel)
{
    const AngleRange range = range_of_lit_beams(problem);
    if (range.first > range.last)  // nothing is lit
        return library_nodes(*channel.library);
    const std::vector<RadialProfile> library_profiles = channel.library->node_profiles(channel.albedo, Side::reflected);
    const auto profile_at = [&](double angle) {
        const auto weights = channel.library->angle_weights(angle);
        RadialProfile sum;
        for (std::size_t j = 0; j < library_profiles.size(); ++j)
            sum.add(library_profiles[j], weights.even[j], weights.odd[j]);
        return sum;
    };

    const std::size_t all = channel.library->results().size();
    for (std::size_t count = 1; count < all; ++count) {
        const std::vector<double> nodes = chebyshev_nodes(range, count);
        std::vector<RadialProfile> profiles;
        for (double node : nodes)
            profiles.push_back(profile_at(node));
        double worst = 0.0;
        // Between the nodes, where the interpolant is farthest off.
        for (double test : chebyshev_nodes(range, 2 * count + 1))
            worst = std::max(worst, distance(profile_at(test), combine(profiles, lagrange_weights(nodes, test))));
        if (worst > problem.tolerance)
            continue;
        BeamBasis basis;
        basis.m_node_count = count;
        basis.m_profiles = [nodes](const Channel& of) {
            std::vector<RadialProfile> result;
            for (double node : nodes)
                result.push_back(of.library->profile(node, of.albedo, Side::reflected));
            return result;
        };
        basis.m_weights = [nodes](const Vec3& direction) {
            const std::vector<double> weights = lagrange_weights(nodes, incidence_deg(direction));
            return Weights{weights, weights};
        };
        return basis;
    }
    return library_nodes(*channel.library);
}

QuadrantKernel::QuadrantKernel(const RadialProfile& profile, const Problem& problem, const Channel& channel)
    : m_width(problem.width), m_texels(problem.width * problem.height)
{
    const double px = problem.pitch_x / channel.mean_free_path;
    const double py = problem.pitch_y / channel.mean_free_path;
    m_integrals = integrate_texels(profile, {-0.5 * px, -0.5 * py, px, py, problem.width, problem.height});
}

void QuadrantKernel::row(std::ptrdiff_t dy, const Harmonics& cosine, const Harmonics& sine,
                         std::vector<double>& values) const
{
    values.assign(2 * m_width - 1, 0.0);
    double* right = values.data() + (m_width - 1);
    const std::size_t first = static_cast<std::size_t>(std::abs(dy)) * m_width;
    for (std::size_t m = 0; m < harmonic_count; ++m) {
        // phi -> -phi for dy < 0, and phi -> pi - phi for dx < 0.
        const double by_sine = dy < 0 ? -sine[m] : sine[m];
        const double mirrored = m % 2 == 0 ? 1.0 : -1.0;
        if (cosine[m] != 0.0) {
            const double* a = m_integrals.cosine.data() + m * m_texels + first;
            for (std::size_t x = 0; x < m_width; ++x)
                right[x] += cosine[m] * a[x];
            for (std::size_t x = 1; x < m_width; ++x)
                values[m_width - 1 - x] += mirrored * cosine[m] * a[x];
        }
        if (by_sine != 0.0) {
            const double* b = m_integrals.sine.data() + m * m_texels + first;
            for (std::size_t x = 0; x < m_width; ++x)
                right[x] += by_sine * b[x];
            for (std::size_t x = 1; x < m_width; ++x)
                values[m_width - 1 - x] -= mirrored * by_sine * b[x];
        }
    }
}

}  // namespace beamspread
