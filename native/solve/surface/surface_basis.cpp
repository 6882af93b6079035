#include "solve/surface/surface_basis.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "base/constants.h"

namespace beamspread {

namespace {

// Number of angles that stand for those of all light.
constexpr std::size_t angle_count = 512;

// Error of kernels over the tolerance of luminances, in which errors of kernels cancel. Larger: fewer functions.
constexpr double tolerance_ratio = 2.0;

// Fraction of a kernel's power outside its reach, over the tolerance. Larger: fewer pairs, less light far away.
constexpr double max_beyond_ratio = 0.1;

// A curved surface needs a function more for this many of a plane. Its LDFs have more noise, for which `within` would take
// up to three times as many. Smaller: more functions, among them some of noise.
constexpr std::size_t functions_per_curved = 4;

// Number of functions of a set: four vectors. More: at ior 1 up to 1.5 times the time; fewer: larger errors where light
// grazes small bodies.
constexpr std::size_t max_functions = 64;

// Number of functions of all sets. They take 2 kB of moments for each sample, those of clusters included. More: smaller
// errors with colored light at ior 1, more memory.
constexpr std::size_t max_functions_of_all = 144;

// The LDFs of one curvature as those of a plane, for the decomposition.
class OneCurvature final : public LdfSource {
public:
    OneCurvature(const LdfSource& source, std::size_t curvature) : m_source(source), m_curvature(curvature) {}

    RadialProfile profile(double angle_deg, double albedo, Side side) const override
    {
        const std::vector<RadialProfile> nodes = node_profiles(albedo, side);
        const AngleWeights weights = angle_weights(angle_deg, side);
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
    AngleWeights angle_weights(double angle_deg, Side side) const override
    {
        return m_source.angle_weights(angle_deg, side);
    }
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
            media.push_back({sources.back().get(), medium.albedo, medium.mean_free_path, medium.side});
        }
    }
    const Incidence incidence = incidence_up_to(max_angle_deg, 0.0);
    const KernelDecomposition kernels(incidence, media, texel);
    std::vector<std::size_t> chosen = kernels.within(tolerance_ratio * tolerance);
    std::erase_if(chosen, [&](std::size_t t) { return kernels.terms()[t].m >= surface_harmonics; });
    std::size_t most = std::min(max_functions, max_functions_of_all / terms.sets.count());
    if (media.size() > terms.sets.media.size()) {
        const KernelDecomposition flat(incidence, terms.sets.media, texel);
        const std::size_t needed = flat.within(tolerance_ratio * tolerance).size();
        most = std::min(most, needed + needed / functions_per_curved);
    }
    // Functions of large gains come first; terms come by ascending m, then rank.
    std::vector<std::size_t> order;
    const auto sort_by_gain = [&] {
        order.resize(chosen.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        const auto gain = [&](std::size_t i) { return kernels.terms()[chosen[i]].gain; };
        if (!order.empty())
            std::stable_sort(order.begin() + 1, order.end(),
                             [&](std::size_t a, std::size_t b) { return gain(a) > gain(b); });
    };
    sort_by_gain();
    if (order.size() > most) {
        const double least = kernels.terms()[chosen[order[most - 1]]].gain;
        std::erase_if(chosen, [&](std::size_t t) { return kernels.terms()[t].gain < least; });
        sort_by_gain();
    }
    terms.basis = kernels.basis(chosen, max_beyond_ratio * tolerance);
    for (std::size_t f = 0; f < chosen.size(); ++f)
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t set = 0; set < terms.sets.count(); ++set)
                if (terms.basis.functions[f].m > 0 || phase == Phase::cosine)
                    terms.terms.push_back({{}, f, phase, set, {}});
    m_number.resize(chosen.size());
    for (std::size_t number = 0; number < order.size(); ++number) {
        m_number[order[number]] = number;
        harmonic.push_back(static_cast<std::int32_t>(terms.basis.functions[order[number]].m));
        rank.push_back(terms.basis.functions[order[number]].rank);
        float most_light = 0.0f;
        for (std::size_t step = 0; step <= terms.basis.steps; ++step)
            most_light = std::max(most_light, std::abs(terms.basis.table[step * chosen.size() + order[number]].value));
        largest.push_back(most_light);
    }
    lanes = PairLanes(terms.sets, harmonic);
}

std::vector<std::size_t> SurfaceBasis::places(std::size_t term) const
{
    const LightTerm& light = terms.terms[term];
    std::vector<std::size_t> all;
    for (std::size_t result = 0; result < lanes.results; ++result) {
        if (terms.sets.results[result].set != light.set)
            continue;
        const std::size_t place = lanes.place(result, m_number[light.function]);
        all.push_back(place + (light.phase == Phase::sine ? lanes_per_block : 0));
        if (!lanes.is_shared())
            break;
    }
    return all;
}

}  // namespace beamspread
