#include "solve/surface/surface_basis.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/constants.h"

namespace beamspread {

namespace {

// Number of angles that stand for those of all light.
constexpr std::size_t angle_count = 512;

// Fraction of a kernel's power outside its reach, at most. Larger: fewer pairs, less light far away.
constexpr double max_beyond = 1e-4;

// The LDFs of one curvature as those of a plane, for the decomposition.
class OneCurvature final : public LdfSource {
public:
    OneCurvature(const LdfSource& source, std::size_t curvature) : m_source(source), m_curvature(curvature) {}

    RadialProfile profile(double angle_deg, double albedo, Side side) const override
    {
        const std::vector<RadialProfile> nodes = node_profiles(albedo, side);
        const AngleWeights weights = angle_weights(angle_deg);
        RadialProfile sum;
        for (std::size_t j = 0; j < nodes.size(); ++j)
            sum.add(nodes[j], weights.even[j], weights.odd[j]);
        sum.keep_harmonics(weights.harmonics(nodes));
        return sum;
    }
    std::vector<RadialProfile> node_profiles(double albedo, Side side) const override
    {
        return m_source.curved_node_profiles(albedo, side, m_curvature);
    }
    AngleWeights angle_weights(double angle_deg) const override { return m_source.angle_weights(angle_deg); }
    void check_angle(double angle_deg) const override { m_source.check_angle(angle_deg); }

private:
    const LdfSource& m_source;
    std::size_t m_curvature;
};

// Beams of all angles up to the largest, as even as those of a sky.
Incidence incidence_up_to(double max_angle_deg, double min_angle_deg)
{
    std::vector<float> irradiance;
    std::vector<float> travel;
    for (std::size_t i = 0; i < angle_count; ++i) {
        const double part = static_cast<double>(i) / static_cast<double>(angle_count - 1);
        const double theta = (min_angle_deg + (max_angle_deg - min_angle_deg) * part) * radians_per_degree;
        irradiance.push_back(static_cast<float>(std::max(std::cos(theta) * std::sin(theta), 1e-3)));
        for (const double value : {std::sin(theta), 0.0, -std::max(std::cos(theta), 1e-6)})
            travel.push_back(static_cast<float>(value));
    }
    const Plane plane{angle_count, 1};
    const View2D<const float> view{irradiance.data(), 1, angle_count, static_cast<std::ptrdiff_t>(angle_count), 1};
    return Incidence(plane, {PlaneLight{view, PerTexel{travel.data()}, {1.0}}});
}

ChannelSets sets_of(const std::vector<ChannelMedium>& channels, bool is_colored)
{
    Problem problem;
    problem.channels = channels;
    for (std::size_t c = 0; c < (is_colored ? channels.size() : 1); ++c) {
        PlaneLight light;
        light.color.assign(channels.size(), is_colored ? 0.0 : 1.0);
        light.color[c] = 1.0;
        problem.lights.push_back(std::move(light));
    }
    return ChannelSets(problem);
}

}  // namespace

SurfaceBasis::SurfaceBasis(const std::vector<ChannelMedium>& channels, double max_angle_deg, double texel,
                           bool is_colored, double tolerance)
    : terms{{}, sets_of(channels, is_colored), {}, {}, {}, {}, {}, {}, {}}
{
    std::vector<std::unique_ptr<OneCurvature>> sources;
    std::vector<ChannelMedium> media;
    for (const ChannelMedium& medium : terms.sets.media) {
        first_profiles.push_back(media.size());
        curvatures.push_back(medium.ldf->curvatures());
        for (std::size_t k = 0; k < curvatures.back().size(); ++k) {
            sources.push_back(std::make_unique<OneCurvature>(*medium.ldf, k));
            media.push_back({sources.back().get(), medium.albedo, medium.mean_free_path});
        }
    }
    const KernelDecomposition kernels(incidence_up_to(max_angle_deg, 0.0), media, texel);
    std::vector<std::size_t> chosen = kernels.within(tolerance);
    std::erase_if(chosen, [&](std::size_t t) { return kernels.terms()[t].m >= harmonics; });
    terms.basis = kernels.basis(chosen, std::min(max_beyond, 0.1 * tolerance));
    std::size_t ranks = 0;
    for (std::size_t f = 0; f < terms.basis.functions.size(); ++f) {
        const auto& [m, rank, values] = terms.basis.functions[f];
        ranks = std::max(ranks, rank + 1);
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t set = 0; set < terms.sets.count() && (m > 0 || phase == Phase::cosine); ++set)
                terms.terms.push_back({{}, f, phase, set, {}});
    }
    blocks = (ranks * harmonics + lanes_per_block - 1) / lanes_per_block;
}

std::size_t SurfaceBasis::place(std::size_t term) const
{
    const LightTerm& light = terms.terms[term];
    const auto& [m, rank, values] = terms.basis.functions[light.function];
    const std::size_t function = rank * harmonics + m;
    const std::size_t block = light.set * blocks + function / lanes_per_block;
    return (2 * block + (light.phase == Phase::sine ? 1 : 0)) * lanes_per_block + function % lanes_per_block;
}

}  // namespace beamspread
