#include "bake/bent_bake.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>

#include "bake/bent_samples.h"
#include "bake/bent_solution.h"
#include "bake/field_bake.h"
#include "bake/nested_texels.h"
#include "base/constants.h"
#include "base/threads.h"
#include "solve/surface/surface_field.h"

namespace beamspread {

namespace {

// Texels, and rays of each, of the survey that finds the mean irradiance of each light where nothing blocks it. More: rays
// are shared more exactly, and it takes longer.
constexpr std::size_t survey_texels = 2048;
constexpr int survey_rays = 4;

// Progress in the units of field_bake.h: a ray to a light with a size, a mean of open and of dim places; tables of the
// medium, of all samples together; the solution of a sample where light goes as far as samples lie apart, and the power
// by which it grows with that distance. Larger: a bar that slows down less there.
constexpr double bent_ray_work = 0.25;
constexpr double tables_work = 1e6;
constexpr double pairs_work = 40.0;
constexpr double reach_power = 0.6;

// Cosine of the angle to the normal, at least, of light at a texel in the frame of a sample of several texels.
constexpr float least_fall = 1e-3f;

// Adds rays at texels to a field of samples.
class SampleSink final : public RaySink {
public:
    SampleSink(const ReceiverGrid& grid, const BentSamples& samples, const std::vector<double>& color,
               SurfaceField& field)
        : m_grid(grid), m_samples(samples), m_color(color), m_field(field)
    {
    }

    void add(const RayRun& run) override
    {
        Scratch& scratch = m_scratch.local();
        scratch.samples.clear();
        scratch.travel.clear();
        scratch.irradiance.clear();
        for (std::size_t i = 0; i < run.count; ++i) {
            const BentSamples::Range& range = m_samples.of_texel[run.sample + i];
            Vec3f travel = run.travel[i];
            Vec3f irradiance = run.irradiance[i];
            if (const BentSamples::Run* const of_many = m_samples.run_of(run.sample + i)) {
                const BentTexel& texel = m_grid.bent_texel(run.sample + i);
                irradiance *= texel.area / of_many->area;
                travel = in_frame(m_samples.all[range.begin], texel, travel);
            }
            for (std::uint32_t k = 0; k < range.count; ++k)
                scratch.samples.push_back(range.begin + k);
            scratch.travel.insert(scratch.travel.end(), range.count, travel);
            scratch.irradiance.insert(scratch.irradiance.end(), range.count, irradiance);
        }
        m_field.add(scratch.samples, scratch.travel.data(), scratch.irradiance.data(), m_color);
    }

private:
    struct Scratch {
        std::vector<std::uint32_t> samples;
        std::vector<Vec3f> travel, irradiance;
    };

    // A direction of a texel's frame in that of a sample of several texels; below its horizon.
    static Vec3f in_frame(const SurfaceSample& sample, const BentTexel& texel, const Vec3f& travel)
    {
        const Vec3f world =
            travel.x * texel.tangent + travel.y * glm::cross(texel.normal, texel.tangent) + travel.z * texel.normal;
        const Vec3f turned(glm::dot(world, sample.tangent), glm::dot(world, glm::cross(sample.normal, sample.tangent)),
                           glm::dot(world, sample.normal));
        return glm::normalize(Vec3f(turned.x, turned.y, std::min(turned.z, -least_fall)));
    }

    const ReceiverGrid& m_grid;
    const BentSamples& m_samples;
    const std::vector<double>& m_color;
    SurfaceField& m_field;
    PerThread<Scratch> m_scratch;
};

// Few texels, evenly chosen among those inside the mesh.
Surface survey_surface(const Surface& surface)
{
    std::vector<std::size_t> inside;
    for (std::size_t i = 0; i < surface.samples(); ++i)
        if (surface.grid.bent_texel(i).area > 0.0f)
            inside.push_back(i);
    const std::size_t count = std::min(survey_texels, inside.size());
    std::vector<BentTexel> texels;
    for (std::size_t i = 0; i < count; ++i)
        texels.push_back(surface.grid.bent_texel(inside[i * inside.size() / count]));
    return {.grid = ReceiverGrid::bent(std::move(texels), count, 1, surface.grid.owner)};
}

double mean_of(const std::vector<double>& color)
{
    return std::accumulate(color.begin(), color.end(), 0.0) / static_cast<double>(color.size());
}

// Mean irradiance by each light where nothing blocks it, over the area and the channels, W/m^2.
std::vector<double> survey(const Surface& surface, const std::vector<const SurfaceLight*>& lights,
                           const BakeOptions& options)
{
    const Surface few = survey_surface(surface);
    BakeOptions quiet = options;
    quiet.samples = 1;
    quiet.noise = nullptr;
    RaySettings settings = quiet.ray_settings(survey_rays);
    settings.even_rays = 0;
    std::vector<double> means;
    for (const SurfaceLight* light : lights) {
        SurfaceLight open = *light;
        open.occluders = nullptr;
        RaySum sum(few.samples(), 3, false);
        Progress unseen;
        open.gather(few, settings, sum, unseen);
        double irradiance = 0.0;
        for (std::size_t i = 0; i < few.samples(); ++i)
            for (std::size_t c = 0; c < 3; ++c)
                irradiance += static_cast<double>(few.grid.bent_texel(i).area * sum.irradiance[3 * i + c]);
        const double area = std::max(few.grid.shape->area, std::numeric_limits<double>::min());
        means.push_back(irradiance / (3.0 * area) * mean_of(light->color));
    }
    return means;
}

// Number of rays from each texel to a light that brings this share of all light.
int rays_of(const BakeOptions& options, double share)
{
    return std::max(options.min_rays, static_cast<int>(std::nearbyint(options.rays * share)));
}

double gather_work(const SurfaceLight& light, int rays)
{
    return light_work + (!light.field && light.has_size() ? bent_ray_work * rays : 0.0);
}

// True if light leaves on the other side than it enters. It may do so without scattering, far from where it enters.
bool is_transmitted(const std::vector<ChannelMedium>& channels)
{
    return std::ranges::any_of(channels,
                               [](const ChannelMedium& channel) { return channel.side == Side::transmitted; });
}

// Work of the solution of all samples, relative to their number.
double pair_work(const BentSamples& samples, const std::vector<ChannelMedium>& channels)
{
    double area = 0.0;
    for (const SurfaceSample& sample : samples.all)
        area += static_cast<double>(sample.area);
    double longest = 0.0;
    for (const ChannelMedium& channel : channels)
        longest = std::max(longest, channel.mean_free_path);
    const double distance = std::sqrt(area / static_cast<double>(samples.all.size()));
    return distance > 0.0 ? pairs_work * std::pow(longest / distance, reach_power) : solver_work;
}

// True if the light of all channels is not proportional.
bool is_colored(const Surface& surface, const std::vector<const SurfaceLight*>& lights)
{
    constexpr double rounding = 1e-6;
    const auto is_like_first = [&](const SurfaceLight* light) {
        const std::vector<double>& first = lights.front()->color;
        for (std::size_t c = 0; c < first.size(); ++c)
            if (std::abs(light->color[c] * mean_of(first) - first[c] * mean_of(light->color)) >
                rounding * mean_of(first) * mean_of(light->color))
                return false;
        return true;
    };
    return std::ranges::any_of(
        lights, [&](const SurfaceLight* light) { return light->is_colored(surface) || !is_like_first(light); });
}

}  // namespace

BentShares bake_bent(const Surface& surface, const std::vector<const SurfaceLight*>& lights,
                     const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                     float* luminance)
{
    std::fill_n(luminance, surface.samples() * channels.size(), 0.0f);
    const auto shorter = [](const ChannelMedium& a, const ChannelMedium& b) {
        return a.mean_free_path < b.mean_free_path;
    };
    const BentSamples samples(surface, std::ranges::min_element(channels, shorter)->mean_free_path);
    if (samples.all.empty() || lights.empty()) {
        progress.finish();
        return {};
    }
    const std::vector<double> means = survey(surface, lights, options);
    const double all = std::accumulate(means.begin(), means.end(), 0.0);
    std::vector<int> rays;
    std::vector<double> works;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        rays.push_back(rays_of(options, all > 0.0 ? means[i] / all : 0.0));
        works.push_back(gather_work(*lights[i], rays.back()));
    }
    const double tables = tables_work / static_cast<double>(samples.all.size());
    std::optional<NestedTexels> nested;
    if (options.solver != Solver::direct && !is_transmitted(channels))
        nested.emplace(surface.grid, samples.whole_texels(surface));
    BentSolution solution(surface.grid, samples, nested ? &*nested : nullptr);
    const double pairs = pair_work(samples, channels) * solution.least_part();
    progress.set_total(std::accumulate(works.begin(), works.end(), tables + pairs));
    const SurfaceProblem problem{.samples = samples.all,
                                 .steps = samples.steps,
                                 .neighbors = samples.neighbors,
                                 .uneven_sides = samples.uneven_sides,
                                 .channels = channels,
                                 .tolerance = options.tolerance,
                                 .is_colored = is_colored(surface, lights),
                                 .threads = options.threads,
                                 .max_moment_bytes = options.max_moment_bytes,
                                 .is_direct = options.solver == Solver::direct};
    std::unique_ptr<SurfaceField> field;
    progress.advance_by(tables, [&](Progress& part) { field = std::make_unique<SurfaceField>(problem, part); });
    RayNoise noise;
    BakeOptions gathering = options;
    gathering.noise = &noise;
    for (std::size_t i = 0; i < lights.size(); ++i)
        progress.advance_by(works[i], [&](Progress& part) {
            SampleSink sink(surface.grid, samples, lights[i]->color, *field);
            lights[i]->gather(surface, gathering.ray_settings(rays[i]), sink, part);
        });
    if (options.noise)
        options.noise->add(noise, 1.0);
    BentSolution::Accuracy accuracy{options.tolerance};
    if (noise.irradiance > 0.0)
        accuracy.noise = std::sqrt(noise.variance) / noise.irradiance;
    for (const ChannelMedium& channel : channels) {
        const double path = channel.mean_free_path / surface.grid.pitch_x;
        accuracy.texels.push_back(1.0 + 4.0 * pi * path * path);
    }
    progress.advance_by(pairs, [&](Progress& part) { solution.solve(*field, accuracy, part, luminance); });
    progress.finish();
    return solution.shares();
}

}  // namespace beamspread
