#include "solve/low_rank.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Dense>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

constexpr std::size_t angle_bins = 64;
constexpr double least_gain = 1e-14;  // that is not rounding
constexpr std::size_t table_steps = 1024;

// Errors of m = 0 count so many times: under even light they add up, while those of the other harmonics cancel.
constexpr double power_weight = 3.0;

struct PresentAngles {
    double first = 1.0;  // half_tangent
    double last = 0.0;
    std::array<double, angle_bins> share{};  // in even bins between them, sum 1: mean of those
                                             // of light, of lit texels and of angles
};

double angle_deg(double half_tangent)
{
    return 2.0 * std::atan(half_tangent) / radians_per_degree;
}

// Fine bins of half_tangent from 0 to 1, and rows that are counted together.
constexpr std::size_t fine_bins = 2048;
constexpr std::size_t rows_per_item = 32;

struct AngleCounts {
    float first = 1.0f;
    float last = 0.0f;
    std::vector<double> light = std::vector<double>(fine_bins, 0.0);
    std::vector<double> texels = std::vector<double>(fine_bins, 0.0);
};

AngleCounts count_angles(const LightField& light, std::size_t first_row, std::size_t last_row)
{
    AngleCounts counts;
    const std::size_t width = light.irradiance.width;
    std::vector<float> irradiance(width);
    std::vector<float> cosine(width);
    std::vector<float> sine(width);
    std::vector<float> place(width);
    for (std::size_t y = first_row; y < last_row; ++y) {
        for (std::size_t x = 0; x < width; ++x)
            irradiance[x] = light.irradiance(y, x);
        find_angles(light.directions.field + 3 * y * width, irradiance.data(), cosine.data(), sine.data(), place.data(),
                    width);
        for (std::size_t x = 0; x < width; ++x) {
            if (irradiance[x] == 0.0f)
                continue;
            counts.first = std::min(counts.first, place[x]);
            counts.last = std::max(counts.last, place[x]);
            const auto bin =
                std::min(static_cast<std::size_t>(place[x] * static_cast<float>(fine_bins)), fine_bins - 1);
            counts.light[bin] += static_cast<double>(irradiance[x]);
            counts.texels[bin] += 1.0;
        }
    }
    return counts;
}

PresentAngles present_angles(const std::vector<LightField>& lights)
{
    PresentAngles present;
    AngleCounts counted;
    const std::size_t height = lights.front().irradiance.height;
    for (const LightField& light : lights) {
        parallel_ordered<AngleCounts>((height + rows_per_item - 1) / rows_per_item,
                                      [&](std::size_t item) {
                                          return count_angles(light, item * rows_per_item,
                                                              std::min(height, (item + 1) * rows_per_item));
                                      },
                                      [&](std::size_t, const AngleCounts& rows) {
                                          counted.first = std::min(counted.first, rows.first);
                                          counted.last = std::max(counted.last, rows.last);
                                          for (std::size_t i = 0; i < fine_bins; ++i) {
                                              counted.light[i] += rows.light[i];
                                              counted.texels[i] += rows.texels[i];
                                          }
                                      });
    }
    present.first = static_cast<double>(counted.first);
    // Rounded up to 90 degrees exactly, an angle would be no angle of incidence.
    present.last = std::min(static_cast<double>(counted.last), 1.0 - 1e-6);
    if (present.first > present.last)
        return present;

    struct Sums {
        std::array<double, angle_bins> light{};
        std::array<double, angle_bins> texels{};
    };
    Sums total;
    const double width = std::max(present.last - present.first, 1e-12) / static_cast<double>(angle_bins);
    for (std::size_t i = 0; i < fine_bins; ++i) {
        const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(fine_bins);
        const double place = std::clamp((middle - present.first) / width, 0.0, static_cast<double>(angle_bins - 1));
        total.light[static_cast<std::size_t>(place)] += counted.light[i];
        total.texels[static_cast<std::size_t>(place)] += counted.texels[i];
    }
    double light = 0.0;
    double texels = 0.0;
    for (std::size_t i = 0; i < angle_bins; ++i) {
        light += total.light[i];
        texels += total.texels[i];
    }
    const auto occupied = std::count_if(total.texels.begin(), total.texels.end(), [](double x) { return x > 0.0; });
    for (std::size_t i = 0; i < angle_bins; ++i)
        if (total.texels[i] > 0.0)
            present.share[i] =
                (total.light[i] / light + total.texels[i] / texels + 1.0 / static_cast<double>(occupied)) / 3.0;
    return present;
}

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

Eigen::Index index(std::size_t i)
{
    return static_cast<Eigen::Index>(i);
}

// Weights of a library's nodes at some angles, [angle][node].
struct NodeWeights {
    Matrix even;
    Matrix odd;

    NodeWeights() = default;
    NodeWeights(const LdfSource& library, const std::vector<double>& half_tangents)
        : even(index(half_tangents.size()), index(library.node_count())), odd(even)
    {
        parallel_for(half_tangents.size(), [&](std::size_t a) {
            const LdfSource::AngleWeights weights = library.angle_weights(angle_deg(half_tangents[a]));
            for (std::size_t j = 0; j < weights.even.size(); ++j) {
                even(index(a), index(j)) = weights.even[j];
                odd(index(a), index(j)) = weights.odd[j];
            }
        });
    }

    const Matrix& of(std::size_t m) const { return m % 2 == 0 ? even : odd; }
};

std::vector<double> evenly(double first, double last, std::size_t count, double offset)
{
    std::vector<double> places(count);
    for (std::size_t i = 0; i < count; ++i)
        places[i] = first + (last - first) * (static_cast<double>(i) + offset) /
                                (static_cast<double>(count) - 1.0 + 2.0 * offset);
    return places;
}

// One harmonic of a medium's LDF at its simulated angles: power per radius bin, scaled so that squares sum to the
// chi-square distance to the mean LDF, relative to its power.
struct AngularMedium {
    std::vector<RadialProfile> nodes;
    NodeWeights weights;  // at the angle bins
    RadialProfile mean;
    std::array<Matrix, harmonic_count> features;  // [node][radius bin]
};

AngularMedium describe(const KernelMedium& of, const PresentAngles& present, const std::vector<double>& angles,
                       double texel)
{
    AngularMedium medium;
    medium.nodes = of.library->node_profiles(of.albedo, Side::reflected);
    const std::size_t nodes = medium.nodes.size();
    medium.weights = NodeWeights(*of.library, angles);
    const Vector share = Eigen::Map<const Vector>(present.share.data(), index(angle_bins));
    const Vector mean_weights = medium.weights.even.transpose() * share;
    for (std::size_t j = 0; j < nodes; ++j)
        medium.mean.add(medium.nodes[j], mean_weights[index(j)], 0.0);

    // Circles that fit into the texel where the beam enters: all that is seen of them is their power.
    const double inside = 0.5 * texel / of.mean_free_path;
    std::size_t first = 0;
    while (first + 1 < radius_bin_count && radius_bin_edge(first + 1) <= inside)
        ++first;
    const auto bins_of = [&](const RadialProfile& profile) {
        Matrix bins(index(harmonic_count), index(radius_bin_count - first));
        Harmonics inner{};
        for (std::size_t k = first; k < radius_bin_count; ++k) {
            const Harmonics outer = profile.cumulative(radius_bin_edge(k));
            for (std::size_t m = 0; m < harmonic_count; ++m)
                bins(index(m), index(k - first)) =
                    m > 0 && k == first && radius_bin_edge(first) <= inside ? 0.0 : outer[m] - inner[m];
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
            if (mean_bins(0, k) <= 1e-12 * power)
                continue;
            for (std::size_t m = 0; m < harmonic_count; ++m) {
                // The mean of cos^2 (m phi) over a turn.
                const double mean_square = m == 0 ? power_weight * power_weight : 0.5;
                medium.features[m](index(j), k) =
                    std::sqrt(mean_square / (mean_bins(0, k) * power)) * bins(index(m), k);
            }
        }
    }
    return medium;
}

// One term of the singular value decomposition of a harmonic: angles times (medium, radius).
struct Candidate {
    std::size_t m;
    std::size_t rank;
    double gain;  // square error that it takes away
    Vector direction;
};

}  // namespace

LowRankBasis low_rank_basis(const std::vector<LightField>& lights, const std::vector<KernelMedium>& media, double texel,
                            double tolerance)
{
    LowRankBasis basis;
    const PresentAngles present = present_angles(lights);
    if (present.first > present.last)
        return basis;
    for (const KernelMedium& medium : media) {
        medium.library->check_angle(angle_deg(present.first));
        medium.library->check_angle(angle_deg(present.last));
    }
    basis.first = present.first;
    basis.last = present.last;

    const std::vector<double> angles = evenly(present.first, present.last, angle_bins, 0.5);
    std::vector<AngularMedium> described;
    for (const KernelMedium& medium : media)
        described.push_back(describe(medium, present, angles, texel));

    const Vector root_share = Eigen::Map<const Vector>(present.share.data(), index(angle_bins)).cwiseSqrt();
    std::vector<Candidate> candidates;
    double error = 0.0;
    for (std::size_t m = 0; m < harmonic_count; ++m) {
        Matrix gram = Matrix::Zero(index(angle_bins), index(angle_bins));
        for (const AngularMedium& medium : described) {
            const Matrix rows = root_share.asDiagonal() * medium.weights.of(m) * medium.features[m];
            gram += rows * rows.transpose() / static_cast<double>(described.size());
        }
        if (gram.trace() <= least_gain)
            continue;
        const Eigen::SelfAdjointEigenSolver<Matrix> solver(gram);
        for (std::size_t rank = 0; rank < angle_bins; ++rank) {
            const Eigen::Index i = index(angle_bins - 1 - rank);
            const double gain = solver.eigenvalues()[i];
            if (gain <= least_gain)
                break;
            error += gain;
            candidates.push_back({m, rank, gain, solver.eigenvectors().col(i)});
        }
    }
    // Harmonics above 0 take two transforms each.
    const auto worth = [](const Candidate& c) { return c.m == 0 ? 2.0 * c.gain : c.gain; };
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](const Candidate& a, const Candidate& b) { return worth(a) > worth(b); });
    std::size_t count = 0;
    while (count < candidates.size() && error > tolerance * tolerance)
        error -= candidates[count++].gain;
    candidates.resize(count);
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return std::pair(a.m, a.rank) < std::pair(b.m, b.rank); });

    std::size_t ranks = 0;
    for (const Candidate& c : candidates)
        ranks = std::max(ranks, c.rank + 1);
    for (std::size_t k = 0; k < media.size(); ++k) {
        ScaledProfile empty{RadialProfile(), media[k].mean_free_path,
                            reach(described[k].mean, media[k].mean_free_path, 1e-3 * tolerance)};
        basis.profiles.emplace_back(ranks, empty);
    }
    std::map<const LdfSource*, NodeWeights> tables;
    for (const KernelMedium& medium : media)
        if (!tables.contains(medium.library))
            tables[medium.library] =
                NodeWeights(*medium.library, evenly(present.first, present.last, table_steps + 1, 0.0));
    for (const Candidate& c : candidates) {
        // The mean over the media, once for each of the two factors of the decomposition.
        const Vector by_angle =
            root_share.cwiseProduct(c.direction) / std::sqrt(c.gain * static_cast<double>(media.size()));
        Vector values = Vector::Zero(index(table_steps + 1));
        for (std::size_t k = 0; k < media.size(); ++k) {
            const Vector by_node = described[k].weights.of(c.m).transpose() * by_angle;
            for (std::size_t j = 0; j < described[k].nodes.size(); ++j) {
                Harmonics weights{};
                weights[c.m] = by_node[index(j)];
                basis.profiles[k][c.rank].profile.add(described[k].nodes[j], weights);
            }
            const Matrix& features = described[k].features[c.m];
            values += tables[media[k].library].of(c.m) * (features * (features.transpose() * by_node));
        }
        LowRankBasis::AngleFunction function{c.m, c.rank, {}};
        for (const double value : values)
            function.values.push_back(static_cast<float>(value));
        basis.functions.push_back(std::move(function));
    }
    return basis;
}

}  // namespace beamspread
