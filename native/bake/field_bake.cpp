#include "bake/field_bake.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "base/constants.h"

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

// Adds all rays of a light to a field, or their moments.
void add_light(const Surface& surface, const SurfaceLight& light, RaySettings settings, LightField& field,
               Progress& progress)
{
    const std::optional<Directions> directions = light.directions(surface.grid);
    settings.with_travel = !directions;
    FieldSink sink(field, light.color, light.is_colored(surface), directions);
    const bool by_moments = light.is_smooth() && field.counts_moments_alone();
    progress.set_total(by_moments ? 2.0 : 1.0);
    if (by_moments)
        progress.advance_by(1.0, [&](Progress& part) {
            light.field->add_inner_moments(surface, light.color, settings.threads, field, part);
        });
    progress.advance_by(1.0, [&](Progress& part) { light.gather(surface, settings, sink, part, !by_moments); });
    progress.finish();
}

// The same plane with few texels, wholly covered.
Surface survey_surface(const Surface& surface)
{
    Surface coarse{.grid = surface.grid, .clearance = surface.clearance};
    coarse.grid.width = std::min(surface.grid.width, survey_texels);
    coarse.grid.height = std::min(surface.grid.height, survey_texels);
    coarse.grid.pitch_x *= static_cast<double>(surface.grid.width) / static_cast<double>(coarse.grid.width);
    coarse.grid.pitch_y *= static_cast<double>(surface.grid.height) / static_cast<double>(coarse.grid.height);
    return coarse;
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
    FieldBake(const Surface& surface, const std::vector<SurfaceLight>& lights, const BakeOptions& options)
        : m_surface(surface), m_lights(lights), m_options(options)
    {
    }

    void run(Problem problem, Progress& progress, float* luminance)
    {
        survey(problem.coming);
        sort_lights();
        set_total(progress);
        StoredLight kept;
        for (const std::size_t i : m_suns)
            progress.advance_by(light_work, [&](Progress& part) {
                kept.add_one_direction(m_surface, m_lights[i], settings_for(i), part);
            });
        problem.lights = kept.lights;
        std::unique_ptr<LightField> field;
        {
            StoredLight examples;
            // The mean direction of each texel: harmonics of all its directions together are weaker.
            RaySettings few = m_options.ray_settings(m_surface, example_rays);
            few.noise = nullptr;
            for (const std::size_t i : m_examples)
                progress.advance_by(light_work, [&](Progress& part) {
                    examples.add_mean_direction(m_surface, m_lights[i], few, part);
                });
            problem.coming.examples = examples.lights;
            problem.coming.irradiance = m_mean;
            for (const std::size_t i : m_later)
                if (m_lights[i].is_smooth())
                    problem.coming.smooth.push_back(m_lights[i].field->smooth_light(m_lights[i].color));
            if (problem.lights.empty() && examples.lights.empty() && m_mean == 0.0) {
                std::fill_n(luminance, problem.plane.texels() * problem.channels.size(), 0.0f);
                return;
            }
            progress.advance_by(solver_work,
                                [&](Progress& part) { field = std::make_unique<LightField>(problem, part); });
        }
        m_survey = {};
        for (const std::size_t i : m_later)
            progress.advance_by(gather_work(i), [&](Progress& part) {
                add_light(m_surface, m_lights[i], settings_for(i), *field, part);
            });
        progress.advance_by(solver_work, [&](Progress& part) { field->solve(part, luminance); });
    }

private:
    // Finds the angles, colors and mean irradiance of lights where nothing blocks them.
    void survey(ComingLight& coming)
    {
        const Surface coarse = survey_surface(m_surface);
        coming.plane = coarse.plane();
        BakeOptions options = m_options;
        options.samples = 1;
        options.noise = nullptr;
        RaySettings settings = options.ray_settings(coarse, survey_rays);
        settings.even_rays = 0;
        Progress unseen;
        for (const SurfaceLight& light : m_lights) {
            SurfaceLight open = light;
            open.occluders = nullptr;
            StoredLight& stored = m_survey.emplace_back();
            if (open.directions(coarse.grid) && !open.field)
                stored.add_one_direction(coarse, open, settings, unseen);
            else
                stored.add_rays(coarse, open, settings, unseen);
            m_means.push_back(stored.mean());
            const std::vector<PlaneLight>& lights =
                light.is_colored(m_surface) ? by_channel(stored.lights) : stored.lights;
            coming.survey.insert(coming.survey.end(), lights.begin(), lights.end());
        }
        m_mean = std::accumulate(m_means.begin(), m_means.end(), 0.0);
    }

    // Decides which lights are kept as suns, which are added as rays or moments, and which of these are examples.
    void sort_lights()
    {
        std::vector<std::size_t> brightest(m_lights.size());
        std::iota(brightest.begin(), brightest.end(), std::size_t{0});
        std::ranges::stable_sort(brightest, std::greater{}, [&](std::size_t i) { return m_means[i]; });
        std::ranges::copy_if(brightest, std::back_inserter(m_suns), [&](std::size_t i) {
            const auto directions = m_lights[i].field ? std::nullopt : m_lights[i].directions(m_surface.grid);
            return directions && std::holds_alternative<OneDirection>(*directions);
        });
        if (m_suns.size() > max_suns)
            m_suns.clear();
        for (const std::size_t i : brightest)
            if (std::ranges::find(m_suns, i) == m_suns.end())
                m_later.push_back(i);
        // A light that the survey missed shines on few texels.
        for (std::size_t k = 0; k < m_later.size(); ++k)
            if (!m_lights[m_later[k]].is_smooth() && (k < max_examples || m_means[m_later[k]] == 0.0))
                m_examples.push_back(m_later[k]);
    }

    // Rays are shared among lights by their mean irradiance.
    RaySettings settings_for(std::size_t i) const
    {
        const bool is_sun = std::ranges::find(m_suns, i) != m_suns.end();
        const double share = m_mean > 0.0 ? m_means[i] / m_mean : 0.0;
        const int rays = static_cast<int>(std::nearbyint(m_options.rays * share));
        return m_options.ray_settings(m_surface, is_sun ? m_options.rays : std::max(m_options.min_rays, rays));
    }

    double gather_work(std::size_t i) const
    {
        const bool is_traced = m_lights[i].light && m_lights[i].has_size() && !m_lights[i].directions(m_surface.grid);
        return light_work + (is_traced ? ray_work * settings_for(i).rays : 0.0);
    }

    void set_total(Progress& progress) const
    {
        double total = light_work * static_cast<double>(m_suns.size() + m_examples.size()) + 2.0 * solver_work;
        for (const std::size_t i : m_later)
            total += gather_work(i);
        progress.set_total(total);
    }

    const Surface& m_surface;
    const std::vector<SurfaceLight>& m_lights;
    const BakeOptions& m_options;
    std::vector<StoredLight> m_survey;  // [light]
    std::vector<double> m_means;        // [light] mean irradiance of the survey, W/m^2
    double m_mean = 0.0;                // sum of these
    std::vector<std::size_t> m_suns, m_later, m_examples;  // lights, the brightest first
};

}  // namespace

void bake_by_field(const Surface& surface, const std::vector<SurfaceLight>& lights, const BakeOptions& options,
                   Problem problem, Progress& progress, float* luminance)
{
    FieldBake(surface, lights, options).run(std::move(problem), progress, luminance);
}

void bake_luminance(const Surface& surface, const std::vector<SurfaceLight>& lights, LightField& field,
                    const BakeOptions& options, Progress& progress, float* luminance)
{
    progress.set_total(light_work * static_cast<double>(lights.size()) + solver_work);
    field.clear();
    for (const SurfaceLight& light : lights)
        progress.advance_by(light_work, [&](Progress& part) {
            add_light(surface, light, options.ray_settings(surface, options.rays), field, part);
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
    problem.coming.plane = {any_light_angles, 1, plane.pitch_x * static_cast<double>(plane.width) / any_light_angles,
                            plane.pitch_y * static_cast<double>(plane.height)};
    problem.coming.survey = is_colored ? by_channel({light}) : std::vector{light};
    Progress unseen;
    return std::make_unique<LightField>(problem, unseen);
}

}  // namespace beamspread
