#include "bake/bent_bake.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "bake/field_bake.h"
#include "base/threads.h"
#include "solve/surface/surface_field.h"

namespace beamspread {

namespace {

// Texels, and rays of each, of the survey that finds the mean irradiance of each light where nothing blocks it. More: rays
// are shared more exactly, and it takes longer.
constexpr std::size_t survey_texels = 2048;
constexpr int survey_rays = 4;

// The solver takes samples as disks, which overlap where texels are long: a texel's light reaches its neighbors beside in
// place of its own ends. Long texels are divided into pieces: their length over width from which on, their length over the
// shortest mean free path below which they stay whole, and their largest number, also for parts of texels. Larger lengths:
// fewer samples, and light that is blurred across long texels (docs/tuning.md).
constexpr double max_stretch = 1.3;
constexpr double short_in_paths = 0.1;
constexpr std::size_t max_pieces = 64;
constexpr std::size_t max_cut_pieces = 8;

// Progress in the units of field_bake.h: a ray to a light with a size, a mean of open and of dim places; tables of the
// medium, of all samples together; the solution of a sample where light goes as far as samples lie apart, and the power
// by which it grows with that distance. Larger: a bar that slows down less there.
constexpr double bent_ray_work = 0.25;
constexpr double tables_work = 1e6;
constexpr double pairs_work = 40.0;
constexpr double reach_power = 0.6;

// Coverage that smaller ones count as: rounding decides about their areas.
constexpr float least_coverage = 1e-5f;

// Replaces the sides of a parallelogram by those of the rectangle of the same covariance, the shorter one first.
void find_axes(Vec3& across, Vec3& along)
{
    const double xx = glm::dot(across, across);
    const double yy = glm::dot(along, along);
    const double xy = glm::dot(across, along);
    const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);  // of the longer axis
    const Vec3 longer = across * std::cos(angle) + along * std::sin(angle);
    across = along * std::cos(angle) - across * std::sin(angle);
    along = longer;
}

// The samples of a mesh, in the order of its texels: one for each texel inside, or several for a long one.
struct Samples {
    Samples(const Surface& surface, double mean_free_path)
    {
        const ReceiverGrid& grid = surface.grid;
        const Vec3 origin = 0.5 * (grid.shape->low + grid.shape->high);
        for (std::size_t i = 0; i < grid.texels(); ++i) {
            first.push_back(all.size());
            const BentTexel& texel = grid.bent_texel(i);
            if (!(texel.area > 0.0f))
                continue;
            Vec3 across(texel.step_x);
            Vec3 along(texel.step_y);
            const float coverage = surface.coverage ? surface.coverage[i] : 1.0f;
            if (coverage < 1.0f)
                find_axes(across, along);
            else
                reduce_steps(across, along);
            const double length = glm::length(along);
            const double longest = std::max(max_stretch * glm::length(across), short_in_paths * mean_free_path);
            const double wanted = length > longest ? std::ceil(length / longest) : 1.0;
            const std::size_t most = coverage < 1.0f ? max_cut_pieces : max_pieces;
            const auto pieces = static_cast<std::size_t>(std::min(wanted, static_cast<double>(most)));
            for (std::size_t k = 0; k < pieces; ++k) {
                const double at = (static_cast<double>(k) + 0.5) / static_cast<double>(pieces) - 0.5;
                all.push_back({Vec3f(texel.position + at * along - origin), texel.normal, texel.tangent,
                               texel.area / static_cast<float>(pieces)});
                steps.push_back({Vec3f(across), Vec3f(along / static_cast<double>(pieces))});
                whole_areas.push_back(all.back().area / std::max(coverage, least_coverage));
            }
        }
        first.push_back(all.size());
    }

    std::vector<SurfaceSample> all;
    std::vector<SampleSteps> steps;
    std::vector<float> whole_areas;  // see `SurfaceProblem`
    std::vector<std::size_t> first;  // [texel], and the number of all
};

// Adds rays at texels to a field of samples.
class SampleSink final : public RaySink {
public:
    SampleSink(const Samples& samples, const std::vector<double>& color, SurfaceField& field)
        : m_samples(samples), m_color(color), m_field(field)
    {
    }

    void add(const RayRun& run) override
    {
        Scratch& scratch = m_scratch.local();
        scratch.travel.clear();
        scratch.irradiance.clear();
        for (std::size_t i = 0; i < run.count; ++i) {
            const std::size_t pieces = m_samples.first[run.sample + i + 1] - m_samples.first[run.sample + i];
            scratch.travel.insert(scratch.travel.end(), pieces, run.travel[i]);
            scratch.irradiance.insert(scratch.irradiance.end(), pieces, run.irradiance[i]);
        }
        if (!scratch.travel.empty())
            m_field.add(m_samples.first[run.sample], scratch.travel.size(), scratch.travel.data(),
                        scratch.irradiance.data(), m_color);
    }

private:
    struct Scratch {
        std::vector<Vec3f> travel, irradiance;
    };

    const Samples& m_samples;
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

// Work of the solution of all samples, relative to their number.
double pair_work(const Samples& samples, const std::vector<ChannelMedium>& channels)
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

double bake_bent(const Surface& surface, const std::vector<const SurfaceLight*>& lights,
                 const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                 float* luminance)
{
    std::fill_n(luminance, surface.samples() * channels.size(), 0.0f);
    const auto shorter = [](const ChannelMedium& a, const ChannelMedium& b) {
        return a.mean_free_path < b.mean_free_path;
    };
    const Samples samples(surface, std::ranges::min_element(channels, shorter)->mean_free_path);
    if (samples.all.empty() || lights.empty()) {
        progress.finish();
        return 0.0;
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
    const double pairs = pair_work(samples, channels);
    progress.set_total(std::accumulate(works.begin(), works.end(), tables + pairs));
    const SurfaceProblem problem{.samples = samples.all,
                                 .steps = samples.steps,
                                 .whole_areas = samples.whole_areas,
                                 .channels = channels,
                                 .tolerance = options.tolerance,
                                 .is_colored = is_colored(surface, lights),
                                 .threads = options.threads,
                                 .max_moment_bytes = options.max_moment_bytes,
                                 .is_direct = options.solver == Solver::direct};
    std::unique_ptr<SurfaceField> field;
    progress.advance_by(tables, [&](Progress& part) { field = std::make_unique<SurfaceField>(problem, part); });
    for (std::size_t i = 0; i < lights.size(); ++i)
        progress.advance_by(works[i], [&](Progress& part) {
            SampleSink sink(samples, lights[i]->color, *field);
            lights[i]->gather(surface, options.ray_settings(rays[i]), sink, part);
        });
    std::vector<float> values(samples.all.size() * channels.size());
    progress.advance_by(pairs, [&](Progress& part) { field->solve(part, values.data()); });
    // The luminance of a texel is the mean of its pieces.
    const std::size_t count = channels.size();
    for (std::size_t i = 0; i < surface.samples(); ++i) {
        const std::size_t pieces = samples.first[i + 1] - samples.first[i];
        for (std::size_t k = samples.first[i]; k < samples.first[i + 1]; ++k)
            for (std::size_t c = 0; c < count; ++c)
                luminance[i * count + c] += values[k * count + c] / static_cast<float>(pieces);
    }
    progress.finish();
    return field->beyond_share();
}

}  // namespace beamspread
