#include "bake/field_bake.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <list>
#include <numeric>
#include <utility>

#include "base/constants.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Suns with an exact kernel of their own beside light that is not stored. Larger: more transforms.
constexpr std::size_t max_suns = 4;

// Lights that terms are chosen for where light is not stored: the brightest. Larger: slower choice.
constexpr std::size_t max_examples = 4;

// Rays from each texel to an example that has a size. Larger: slower choice, less noise in it.
constexpr int example_rays = 4;

// Texels along a side, and rays, of the survey, which finds the angles and the mean irradiance of lights that nothing
// blocks. Larger: slower choice.
constexpr std::size_t survey_texels = 96;
constexpr int survey_rays = 4;

// The same on a patch among many, at least.
constexpr std::size_t min_survey_texels = 12;

// Length of the mean direction of a light's rays at a texel, weighed by irradiance and averaged over texels, below which its
// directions are broad: even light from a cone of half the angle 45 degrees has .87. Larger: more lights share terms for
// all angles.
constexpr double broad = 0.9;

// Errors of terms that broad light does without count as much more if it is traced: what it loses has noise of its rays,
// which differs from plane to plane. Larger: more terms, smaller errors.
constexpr double traced_weight = 2.0;

// Unit of progress, as those of field_bake.h: one ray from each texel to a light with a size. Larger: a bar that slows
// down less at such lights.
constexpr double ray_work = 0.4;

// Number of angles, and irradiance in W/m^2, of the light that stands for any light. More angles: slower choice.
constexpr std::size_t any_light_angles = 256;
constexpr float any_light_irradiance = 1e3f;

// Adds rays to a field.
class FieldSink final : public RaySink {
public:
    // `directions`: those of all rays; none if each ray has its own.
    FieldSink(LightField& field, const std::vector<double>& color, bool is_colored,
              const std::optional<Directions>& directions)
        : m_field(field), m_color(color), m_is_colored(is_colored), m_directions(directions)
    {
    }

    void add(const RayRun& run) override
    {
        const std::size_t y = run.sample / m_field.plane().width;
        const std::size_t x = run.sample % m_field.plane().width;
        const Vec3f* travel = run.travel;
        if (m_directions) {
            std::vector<Vec3f>& texels = m_scratch.local();
            texels.resize(run.count);
            for (std::size_t i = 0; i < run.count; ++i)
                texels[i] = Vec3f(travel_at(m_field.plane(), *m_directions, y, x + i));
            travel = texels.data();
        }
        m_field.add({y, x, run.count, &travel->x, &run.irradiance->x}, m_color, m_is_colored);
    }

private:
    LightField& m_field;
    const std::vector<double>& m_color;
    bool m_is_colored;
    std::optional<Directions> m_directions;
    PerThread<std::vector<Vec3f>> m_scratch;
};

// Adds all rays of a light to a field, or their moments. `settings`: [patch].
void add_light(const CanvasLight& light, std::vector<RaySettings> settings, LightField& field, Progress& progress)
{
    const std::optional<Directions> directions = light.directions();
    for (RaySettings& of_patch : settings)
        of_patch.with_travel = !directions;
    FieldSink sink(field, light.color(), light.is_colored(), directions);
    const bool by_moments = light.is_smooth() && field.counts_moments_alone();
    progress.set_total(by_moments ? 2.0 : 1.0);
    if (by_moments)
        progress.advance_by(1.0,
                            [&](Progress& part) { light.add_inner_moments(settings.front().threads, field, part); });
    progress.advance_by(1.0, [&](Progress& part) { light.gather(settings, sink, part, !by_moments); });
    progress.finish();
}

// Each light as one for each channel, so that no channel counts as a multiple of another.
std::vector<PlaneLight> by_channel(const std::vector<PlaneLight>& lights)
{
    std::vector<PlaneLight> apart;
    for (const PlaneLight& light : lights)
        for (std::size_t c = 0; c < light.color.size(); ++c) {
            apart.push_back(light);
            apart.back().color.assign(light.color.size(), 0.0);
            apart.back().color[c] = light.color[c];
        }
    return apart;
}

// Luminance of lights of any number and size by a light field, in memory that does not grow with them.
class FieldBake {
public:
    FieldBake(const Canvas& canvas, const std::vector<CanvasLight>& lights, const BakeOptions& options)
        : m_canvas(canvas), m_lights(lights), m_options(options)
    {
    }

    void run(const Problem& problem, Progress& progress, float* luminance)
    {
        survey();
        group_lights();
        set_total(progress);
        const std::size_t values = problem.plane.texels() * problem.channels.size();
        std::fill_n(luminance, values, 0.0f);
        std::vector<float> part_of_sum;  // luminance of a group beside the first
        for (const Group& group : m_groups) {
            const bool is_first = &group == &m_groups.front();
            part_of_sum.resize(is_first ? 0 : values);
            run(group, problem, progress, is_first ? luminance : part_of_sum.data());
            add_scaled(luminance, part_of_sum.data(), 1.0f, part_of_sum.size());
        }
    }

private:
    // Lights that share a field, the brightest first.
    struct Group {
        std::vector<std::size_t> suns;      // kept, each with a kernel of its own
        std::vector<std::size_t> later;     // added as rays or moments
        std::vector<std::size_t> examples;  // those of them for whose luminance terms are chosen
        std::vector<std::size_t> smooth;    // those of them for whose moments terms are chosen
    };

    void run(const Group& group, Problem problem, Progress& progress, float* luminance)
    {
        StoredLight kept;
        for (const std::size_t i : group.suns)
            progress.advance_by(light_work, [&](Progress& part) {
                kept.add_one_direction(m_canvas, m_lights[i], m_options.ray_settings(m_options.rays), part);
            });
        problem.lights = kept.lights;
        std::unique_ptr<LightField> field;
        {
            StoredLight examples;
            // The mean direction of each texel: harmonics of all its directions together are weaker.
            RaySettings few = m_options.ray_settings(example_rays);
            few.noise = nullptr;
            for (const std::size_t i : group.examples)
                progress.advance_by(
                    light_work, [&](Progress& part) { examples.add_mean_direction(m_canvas, m_lights[i], few, part); });
            problem.coming.examples = examples.lights;
            double mean = 0.0;
            for (const auto* lights : {&group.suns, &group.later})
                for (const std::size_t i : *lights) {
                    mean += m_means[i];
                    std::ranges::copy(m_surveys[i].lights, std::back_inserter(problem.coming.survey));
                }
            double faint = 0.0;
            bool is_traced = false;
            for (const std::size_t i : group.smooth) {
                faint += m_means[i];
                is_traced |= !m_lights[i].is_smooth();
                progress.advance_by(light_work, [&](Progress& part) {
                    problem.coming.smooth.push_back(m_lights[i].smooth_light(m_options.ray_settings(1), part));
                });
            }
            // Smooth light is alone in the shadows of others, where its errors count against it and not against all.
            problem.coming.irradiance = std::sqrt(faint * m_mean) / (is_traced ? traced_weight : 1.0);
            if (problem.lights.empty() && examples.lights.empty() && mean == 0.0)
                return;
            progress.advance_by(solver_work,
                                [&](Progress& part) { field = std::make_unique<LightField>(problem, part); });
        }
        for (const std::size_t i : group.later)
            progress.advance_by(gather_work(i),
                                [&](Progress& part) { add_light(m_lights[i], settings_for(i), *field, part); });
        progress.advance_by(solver_work, [&](Progress& part) { field->solve(part, luminance); });
    }

    // A light where nothing blocks it, at few texels of each patch.
    struct Survey {
        std::list<StoredLight> stored;
        std::vector<SurveyedLight> lights;  // parts of these
    };

    // Finds the angles, colors and mean irradiance of lights where nothing blocks them.
    void survey()
    {
        m_surveys.resize(m_lights.size());
        m_means.assign(m_lights.size(), 0.0);
        m_flows.assign(m_lights.size(), 0.0);
        m_patch_means.assign(m_lights.size(), std::vector<double>(m_canvas.patches.size()));
        for (std::size_t i = 0; i < m_canvas.patches.size(); ++i)
            survey(i);
        m_mean = std::accumulate(m_means.begin(), m_means.end(), 0.0);
    }

    void survey(std::size_t i)
    {
        const Patch& patch = m_canvas.patches[i];
        const double share = m_canvas.share(patch);
        const Surface coarse = patch.surface->coarse(share, survey_texels, min_survey_texels);
        const Canvas alone(coarse);
        const double texels_each =
            static_cast<double>(patch.surface->samples()) / static_cast<double>(coarse.samples());
        BakeOptions options = m_options;
        options.samples = 1;
        options.at_centers = true;
        options.noise = nullptr;
        RaySettings settings = options.ray_settings(survey_rays);
        settings.even_rays = 0;
        Progress unseen;
        for (std::size_t l = 0; l < m_lights.size(); ++l) {
            const SurfaceLight* const light = m_lights[l].parts()[i];
            if (!light)
                continue;
            SurfaceLight open = *light;
            open.occluders = nullptr;
            const CanvasLight on_patch(alone, {&open});
            StoredLight& stored = m_surveys[l].stored.emplace_back();
            if (open.directions(coarse.grid) && !open.field)
                stored.add_one_direction(alone, on_patch, settings, unseen);
            else
                stored.add_rays(alone, on_patch, settings, unseen);
            m_flows[l] += share * stored.mean_flow(coarse.plane());
            m_patch_means[l][i] = stored.mean();
            m_means[l] += share * m_patch_means[l][i];
            for (const PlaneLight& part : light->is_colored(*patch.surface) ? by_channel(stored.lights) : stored.lights)
                m_surveys[l].lights.push_back({coarse.plane(), texels_each, part});
        }
    }

    // True if terms are chosen by the moments of a light: they would be the same at most texels, or its rays have no
    // direction in common.
    bool is_smooth(std::size_t i) const
    {
        const bool is_broad = m_lights[i].has_size() && !m_canvas.is_mirrored() && m_flows[i] < broad * m_means[i];
        return m_lights[i].is_smooth() || is_broad;
    }

    // Decides which lights share a field. Smooth light has one of its own beside others: its angles fill the hemisphere and
    // its channels differ, so that it would add terms of all angles and channels to a lamp that needs few.
    void group_lights()
    {
        std::vector<std::size_t> brightest(m_lights.size());
        std::iota(brightest.begin(), brightest.end(), std::size_t{0});
        std::ranges::stable_sort(brightest, std::greater{}, [&](std::size_t i) { return m_means[i]; });
        Group others;
        Group smooth;
        std::ranges::copy_if(brightest, std::back_inserter(others.suns), [&](std::size_t i) {
            const auto directions = m_lights[i].is_field() ? std::nullopt : m_lights[i].directions();
            return directions && std::holds_alternative<OneDirection>(*directions);
        });
        if (others.suns.size() > max_suns)
            others.suns.clear();
        for (const std::size_t i : brightest)
            if (std::ranges::find(others.suns, i) == others.suns.end())
                (is_smooth(i) ? smooth : others).later.push_back(i);
        // A light that the survey missed shines on few texels.
        for (std::size_t k = 0; k < others.later.size(); ++k)
            if (k < max_examples || m_means[others.later[k]] == 0.0)
                others.examples.push_back(others.later[k]);
        smooth.smooth = smooth.later;
        if (others.later.empty()) {
            std::swap(others.later, smooth.later);
            std::swap(others.smooth, smooth.smooth);
        }
        m_groups.push_back(std::move(others));
        if (!smooth.later.empty())
            m_groups.push_back(std::move(smooth));
    }

    // Rays of a light from each texel of each patch: lights share them by their mean irradiance there.
    std::vector<RaySettings> settings_for(std::size_t i) const
    {
        std::vector<RaySettings> settings;
        for (std::size_t patch = 0; patch < m_canvas.patches.size(); ++patch) {
            double all = 0.0;
            for (const std::vector<double>& means : m_patch_means)
                all += means[patch];
            const double share = all > 0.0 ? m_patch_means[i][patch] / all : 0.0;
            const int rays = static_cast<int>(std::nearbyint(m_options.rays * share));
            settings.push_back(m_options.ray_settings(std::max(m_options.min_rays, rays)));
        }
        return settings;
    }

    double gather_work(std::size_t i) const
    {
        const bool is_traced = !m_lights[i].is_field() && m_lights[i].has_size() && !m_lights[i].has_one_direction();
        const double share = m_mean > 0.0 ? m_means[i] / m_mean : 0.0;
        return light_work + (is_traced ? ray_work * std::max<double>(m_options.min_rays, m_options.rays * share) : 0.0);
    }

    void set_total(Progress& progress) const
    {
        double total = 0.0;
        for (const Group& group : m_groups) {
            const std::size_t known = group.suns.size() + group.examples.size() + group.smooth.size();
            total += light_work * static_cast<double>(known) + 2.0 * solver_work;
            for (const std::size_t i : group.later)
                total += gather_work(i);
        }
        progress.set_total(total);
    }

    const Canvas& m_canvas;
    const std::vector<CanvasLight>& m_lights;
    const BakeOptions& m_options;
    std::vector<Survey> m_surveys;  // [light]
    std::vector<double> m_means;    // [light] mean irradiance of the survey, W/m^2
    std::vector<double> m_flows;    // [light] mean over texels of the length of the flow, W/m^2
    std::vector<std::vector<double>> m_patch_means;  // [light][patch]
    double m_mean = 0.0;                             // sum of these
    std::vector<Group> m_groups;
};

}  // namespace

void bake_by_field(const Canvas& canvas, const std::vector<CanvasLight>& lights, const BakeOptions& options,
                   const Problem& problem, Progress& progress, float* luminance)
{
    FieldBake(canvas, lights, options).run(problem, progress, luminance);
}

void bake_luminance(const Surface& surface, const std::vector<SurfaceLight>& lights, LightField& field,
                    const BakeOptions& options, Progress& progress, float* luminance)
{
    progress.set_total(light_work * static_cast<double>(lights.size()) + solver_work);
    field.clear();
    Surface open = surface;  // the field has no room for mirror images
    open.mirrored = 0.0;
    const Canvas alone(open);
    for (const SurfaceLight& light : lights)
        progress.advance_by(light_work, [&](Progress& part) {
            add_light(CanvasLight(alone, {&light}), {options.ray_settings(options.rays)}, field, part);
        });
    progress.advance_by(solver_work, [&](Progress& part) { field.solve(part, luminance); });
    surface.scale_by_color_out(field.channels(), luminance);
    progress.finish();
}

std::unique_ptr<LightField> any_light_field(const Plane& plane, const std::vector<ChannelMedium>& channels,
                                            double max_angle, double tolerance, bool is_colored, int threads)
{
    // Angles of incidence are even in tan(theta / 2); the azimuth does not matter.
    std::vector<float> travel;
    const double max_half_tangent = std::tan(0.5 * max_angle * radians_per_degree);
    for (std::size_t i = 0; i < any_light_angles; ++i) {
        const double theta = 2.0 * std::atan(max_half_tangent * static_cast<double>(i) / (any_light_angles - 1));
        travel.insert(travel.end(), {static_cast<float>(std::sin(theta)), 0.0f, static_cast<float>(-std::cos(theta))});
    }
    const std::vector<float> irradiance(any_light_angles, any_light_irradiance);
    const PlaneLight light{{irradiance.data(), 1, any_light_angles, any_light_angles},
                           PerTexel{travel.data()},
                           std::vector<double>(channels.size(), 1.0)};
    Problem problem;
    problem.plane = plane;
    problem.channels = channels;
    problem.tolerance = tolerance;
    problem.threads = threads;
    const Plane few{any_light_angles, 1, plane.pitch_x * static_cast<double>(plane.width) / any_light_angles,
                    plane.pitch_y * static_cast<double>(plane.height)};
    const double texels_each = static_cast<double>(plane.texels()) / any_light_angles;
    for (const PlaneLight& part : is_colored ? by_channel({light}) : std::vector{light})
        problem.coming.survey.push_back({few, texels_each, part});
    Progress unseen;
    return std::make_unique<LightField>(problem, unseen);
}

}  // namespace beamspread
