#include "solve/separable/low_rank.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Dense>

#include "base/threads.h"

namespace beamspread {

namespace {

constexpr std::size_t angle_count = Incidence::count;

// Smallest gain of a term, relative to the squared light, above rounding errors.
constexpr double min_gain = 1e-14;

// Steps of the tables u(theta), which are linear in between. More: smaller errors, more memory.
constexpr std::size_t table_steps = 4096;

// Weight of errors of m = 0, which add up under even light, over those of other harmonics, which cancel. Larger: more
// exact totals, less exact detail.
constexpr double power_weight = 3.0;

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Eigen::Index index(std::size_t i)
{
    return static_cast<Eigen::Index>(i);
}

// Weights of a library's nodes at some angles.
class NodeWeights {
public:
    NodeWeights() = default;
    NodeWeights(const ChannelMedium& medium, const std::vector<double>& half_tangents) : m_weights(half_tangents.size())
    {
        parallel_for(half_tangents.size(), [&](std::size_t a) {
            m_weights[a] = medium.ldf->angle_weights(angle_deg(half_tangents[a]), medium.side);
        });
    }

    // Weights of a harmonic, [angle][node].
    Matrix of(std::size_t m, const std::vector<RadialProfile>& nodes) const
    {
        Matrix matrix = Matrix::Zero(index(m_weights.size()), index(nodes.size()));
        for (std::size_t a = 0; a < m_weights.size(); ++a)
            if (m < m_weights[a].harmonics(nodes))
                matrix.row(index(a)) = row(a, m);
        return matrix;
    }

    // Values of a harmonic at the angles.
    Vector interpolated(std::size_t m, const std::vector<RadialProfile>& nodes, const Vector& at_nodes) const
    {
        Vector values = Vector::Zero(index(m_weights.size()));
        for (std::size_t a = 0; a < m_weights.size(); ++a)
            if (m < m_weights[a].harmonics(nodes))
                values[index(a)] = row(a, m).dot(at_nodes);
        return values;
    }

private:
    Eigen::Map<const Vector> row(std::size_t a, std::size_t m) const
    {
        const std::vector<double>& weights = m % 2 == 0 ? m_weights[a].even : m_weights[a].odd;
        return {weights.data(), index(weights.size())};
    }

    std::vector<LdfSource::AngleWeights> m_weights;
};

std::vector<double> evenly_spaced(double first, double last, std::size_t count)
{
    std::vector<double> values(count);
    for (std::size_t i = 0; i < count; ++i)
        values[i] = first + (last - first) * static_cast<double>(i) / static_cast<double>(count - 1);
    return values;
}

// A medium's LDF at its simulated angles. Features are powers of radius bins, scaled so that their squares sum to the
// chi-square distance to the mean LDF, relative to its power.
struct AngularMedium {
    std::vector<RadialProfile> nodes;
    NodeWeights weights;  // at the present angles
    RadialProfile mean;
    std::array<Matrix, harmonic_count> features;  // [node][radius bin]
};

AngularMedium angular_medium(const ChannelMedium& channel, const Incidence& incidence,
                             const std::vector<double>& angles, double texel)
{
    AngularMedium medium;
    medium.nodes = channel.ldf->node_profiles(channel.albedo, channel.side);
    const std::size_t nodes = medium.nodes.size();
    medium.weights = NodeWeights(channel, angles);
    const Vector share = Eigen::Map<const Vector>(incidence.share.data(), index(angle_count));
    const Vector mean_weights = medium.weights.of(0, medium.nodes).transpose() * share;
    for (std::size_t j = 0; j < nodes; ++j)
        medium.mean.add(medium.nodes[j], mean_weights[index(j)], 0.0);

    // Join the bins inside the beam's own texel, which resolves their power alone.
    const double inside = 0.5 * texel / channel.mean_free_path;
    std::vector<double> radii = profile_radii(medium.mean.detail());
    while (radii.size() > 1 && radii[1] <= inside)
        radii.erase(radii.begin());
    const auto bins_of = [&](const RadialProfile& profile) {
        Matrix bins(index(harmonic_count), index(radii.size()));
        Harmonics inner{};
        for (std::size_t k = 0; k < radii.size(); ++k) {
            const Harmonics outer = profile.cumulative(radii[k]);
            for (std::size_t m = 0; m < harmonic_count; ++m)
                bins(index(m), index(k)) = m > 0 && k == 0 && radii[0] <= inside ? 0.0 : outer[m] - inner[m];
            inner = outer;
        }
        return bins;
    };
    const Matrix mean_bins = bins_of(medium.mean);
    const double power = mean_bins.row(0).sum();
    for (Matrix& features : medium.features)
        features = Matrix::Zero(index(nodes), mean_bins.cols());
    for (std::size_t j = 0; j < nodes; ++j) {
        const Matrix bins = bins_of(medium.nodes[j]);
        for (Eigen::Index k = 0; k < bins.cols(); ++k) {
            // Skip bins with nothing but rounding errors.
            if (mean_bins(0, k) <= 1e-12 * power)
                continue;
            for (std::size_t m = 0; m < harmonic_count; ++m) {
                // Mean of cos^2(m phi) over a turn; m = 0 with its weight.
                const double mean_square = m == 0 ? power_weight * power_weight : 0.5;
                medium.features[m](index(j), k) =
                    std::sqrt(mean_square / (mean_bins(0, k) * power)) * bins(index(m), k);
            }
        }
    }
    return medium;
}

}  // namespace

struct KernelDecomposition::Angular {
    std::vector<AngularMedium> media;
    std::vector<Vector> direction;  // [term]: unit vectors over the present angles
    Vector root_share;
    std::map<std::pair<const LdfSource*, Side>, NodeWeights> tables;
};

KernelDecomposition::KernelDecomposition(const Incidence& incidence, const std::vector<ChannelMedium>& media,
                                         double texel)
    : m_media(media), m_first(incidence.first), m_last(incidence.last), m_angular(std::make_unique<Angular>())
{
    for (const ChannelMedium& medium : media) {
        medium.ldf->check_angle(angle_deg(m_first));
        medium.ldf->check_angle(angle_deg(m_last));
    }
    const std::vector<double> angles = evenly_spaced(m_first, m_last, angle_count);
    for (const ChannelMedium& medium : media) {
        m_angular->media.push_back(angular_medium(medium, incidence, angles, texel));
        const std::pair source(medium.ldf, medium.side);
        if (!m_angular->tables.contains(source))
            m_angular->tables[source] = NodeWeights(medium, evenly_spaced(m_first, m_last, table_steps + 1));
    }
    const Vector root_share = Eigen::Map<const Vector>(incidence.share.data(), index(angle_count)).cwiseSqrt();
    m_angular->root_share = root_share;
    for (std::size_t m = 0; m < harmonic_count; ++m) {
        Matrix gram = Matrix::Zero(index(angle_count), index(angle_count));
        for (const AngularMedium& medium : m_angular->media) {
            const Matrix rows = root_share.asDiagonal() * medium.weights.of(m, medium.nodes) * medium.features[m];
            gram += rows * rows.transpose() / static_cast<double>(media.size());
        }
        if (gram.trace() <= min_gain)
            continue;
        const Eigen::SelfAdjointEigenSolver<Matrix> solver(gram);
        for (std::size_t rank = 0; rank < angle_count; ++rank) {
            const Eigen::Index i = index(angle_count - 1 - rank);
            const double gain = solver.eigenvalues()[i];
            if (gain <= min_gain)
                break;
            m_terms.push_back({m, rank, gain});
            m_angular->direction.emplace_back(solver.eigenvectors().col(i));
        }
    }
}

KernelDecomposition::~KernelDecomposition() = default;

double KernelDecomposition::function(std::size_t term, double half_tangent) const
{
    const double step = std::max(m_last - m_first, 1e-12) / static_cast<double>(angle_count - 1);
    const double position = std::clamp((half_tangent - m_first) / step, 0.0, static_cast<double>(angle_count - 1));
    const double below = std::min(std::floor(position), static_cast<double>(angle_count - 2));
    const double size = std::sqrt(m_terms[term].gain) / (m_terms[term].m == 0 ? power_weight : 1.0);
    const auto at = [&](Eigen::Index i) {
        const double root = m_angular->root_share[i];
        return root > 0.0 ? size * m_angular->direction[term][i] / root : 0.0;
    };
    const auto angle = static_cast<Eigen::Index>(below);
    return at(angle) + (position - below) * (at(angle + 1) - at(angle));
}

std::vector<std::size_t> KernelDecomposition::within(double tolerance) const
{
    std::vector<std::size_t> order(m_terms.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    // Compute the gain per transform: harmonics above 0 take two.
    const auto worth = [&](std::size_t t) { return m_terms[t].m == 0 ? 2.0 * m_terms[t].gain : m_terms[t].gain; };
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return worth(a) < worth(b); });
    double error = 0.0;
    std::size_t dropped = 0;
    while (dropped < order.size() && error + m_terms[order[dropped]].gain <= tolerance * tolerance)
        error += m_terms[order[dropped++]].gain;
    order.erase(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(dropped));
    std::sort(order.begin(), order.end());
    return order;
}

LowRankBasis KernelDecomposition::basis(const std::vector<std::size_t>& chosen, double beyond) const
{
    LowRankBasis basis;
    basis.first = m_first;
    basis.last = m_last;
    std::size_t ranks = 0;
    for (const std::size_t t : chosen)
        ranks = std::max(ranks, m_terms[t].rank + 1);
    for (std::size_t k = 0; k < m_media.size(); ++k) {
        const ScaledProfile empty{RadialProfile(), m_media[k].mean_free_path,
                                  m_angular->media[k].mean.reach(beyond) * m_media[k].mean_free_path};
        basis.profiles.emplace_back(ranks, empty);
    }
    // [medium][rank][node]
    std::vector<std::vector<std::vector<Harmonics>>> weights;
    for (const AngularMedium& medium : m_angular->media)
        weights.emplace_back(ranks, std::vector<Harmonics>(medium.nodes.size()));
    basis.steps = table_steps;
    basis.table.resize((table_steps + 1) * chosen.size());
    for (const std::size_t t : chosen) {
        const auto& [m, rank, gain] = m_terms[t];
        // Compute the right factor of the decomposition; gains are means over the media.
        const Vector by_angle = m_angular->root_share.cwiseProduct(m_angular->direction[t]) /
                                std::sqrt(gain * static_cast<double>(m_media.size()));
        Vector values = Vector::Zero(index(table_steps + 1));
        for (std::size_t k = 0; k < m_media.size(); ++k) {
            const AngularMedium& medium = m_angular->media[k];
            const Vector by_node = medium.weights.of(m, medium.nodes).transpose() * by_angle;
            for (std::size_t j = 0; j < medium.nodes.size(); ++j)
                weights[k][rank][j][m] = by_node[index(j)];
            const Matrix& features = medium.features[m];
            const NodeWeights& table = m_angular->tables.at({m_media[k].ldf, m_media[k].side});
            values += table.interpolated(m, medium.nodes, features * (features.transpose() * by_node));
        }
        for (std::size_t i = 0; i <= table_steps; ++i) {
            const auto here = static_cast<float>(values[index(i)]);
            const auto next = static_cast<float>(values[index(std::min(i + 1, table_steps))]);
            basis.table[i * chosen.size() + basis.functions.size()] = {here, next - here};
        }
        basis.functions.push_back({m, rank});
    }
    parallel_for(m_media.size() * ranks, [&](std::size_t item) {
        const std::size_t k = item / ranks;
        const std::size_t rank = item % ranks;
        for (std::size_t j = 0; j < weights[k][rank].size(); ++j)
            basis.profiles[k][rank].profile.add(m_angular->media[k].nodes[j], weights[k][rank][j]);
    });
    return basis;
}

}  // namespace beamspread
