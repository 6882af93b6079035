#include "bake/bake.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "bake/bent_bake.h"
#include "bake/canvas.h"
#include "bake/canvas_light.h"
#include "bake/entering.h"
#include "bake/field_bake.h"
#include "bake/stored_light.h"
#include "base/threads.h"
#include "simd/loops.h"
#include "solve/solve.h"

namespace beamspread {

namespace {

// Rays of a texel for each ray of its first pass (`RaySettings::even_rays`), and bounds of the latter; the upper one is
// at least as large as the square of the samples that are asked for. More rays of the first pass are slower and miss fewer
// shadows.
constexpr int rays_per_even_ray = 8;
constexpr int min_even_rays = 4;
constexpr int max_even_rays = 16;

// Texels of a canvas of several patches, and bytes of moments of each, about. More: fewer choices of terms, more memory.
constexpr std::size_t canvas_texels = std::size_t{1} << 21;
constexpr std::size_t moment_bytes = 400;

// Luminance of lights whose irradiance is stored before the solver begins. Lights of many rays, which `direct` and
// `adaptive` solve ray by ray, are stored one after the other.
void bake_stored(const Canvas& canvas, const std::vector<CanvasLight>& lights, const BakeOptions& options,
                 Problem problem, Progress& progress, float* luminance)
{
    const bool all_have_one = std::ranges::all_of(lights, &CanvasLight::has_one_direction);
    const std::size_t group_size = all_have_one ? std::max<std::size_t>(lights.size(), 1) : 1;
    const std::size_t groups = lights.size() / group_size;
    const std::size_t values = problem.plane.texels() * problem.channels.size();
    progress.set_total(light_work * static_cast<double>(lights.size()) + solver_work);
    std::fill_n(luminance, values, 0.0f);
    std::vector<float> part_of_sum;  // luminance of a group beside the first
    for (std::size_t group = 0; group < groups; ++group) {
        StoredLight stored;
        for (std::size_t i = group * group_size; i < (group + 1) * group_size; ++i)
            progress.advance_by(light_work, [&](Progress& part) {
                RaySettings settings = options.ray_settings(options.rays);
                if (lights[i].has_one_direction()) {
                    stored.add_one_direction(canvas, lights[i], settings, part);
                } else {
                    settings.even_rays = 0;
                    stored.add_rays(canvas, lights[i], settings, part);
                }
            });
        if (stored.lights.empty())
            continue;
        problem.lights = stored.lights;
        part_of_sum.resize(group == 0 ? 0 : values);
        progress.advance_by(solver_work / static_cast<double>(groups),
                            [&](Progress& part) { solve(problem, part, group == 0 ? luminance : part_of_sum.data()); });
        add_scaled(luminance, part_of_sum.data(), 1.0f, part_of_sum.size());
    }
}

std::vector<CanvasLight> on_canvas(const Canvas& canvas, const std::vector<ArrivingLights>& lights)
{
    std::vector<CanvasLight> on_patches;
    for (std::size_t l = 0; l < lights.front().size(); ++l) {
        std::vector<const SurfaceLight*> parts;
        for (const Patch& patch : canvas.patches) {
            const std::optional<SurfaceLight>& light = lights[patch.index][l];
            parts.push_back(light ? &*light : nullptr);
        }
        if (std::ranges::any_of(parts, [](const SurfaceLight* part) { return part != nullptr; }))
            on_patches.emplace_back(canvas, std::move(parts));
    }
    return on_patches;
}

// Luminance of a canvas without the color of light that leaves its surfaces.
void bake_canvas(const Canvas& canvas, const std::vector<ArrivingLights>& arriving, const BakeOptions& options,
                 Problem problem, Progress& progress, float* luminance)
{
    problem.plane = canvas.plane;
    const std::vector<CanvasLight> lights = on_canvas(canvas, arriving);
    const bool all_have_one = std::ranges::all_of(lights, &CanvasLight::has_one_direction);
    const bool fits = lights.size() * canvas.samples() * sizeof(float) <= options.max_stored_bytes;
    if (options.solver != Solver::fft || (all_have_one && fits))
        bake_stored(canvas, lights, options, std::move(problem), progress, luminance);
    else
        bake_by_field(canvas, lights, options, problem, progress, luminance);
    progress.finish();
}

// Adds the noise of a part of all surfaces, which has that fraction of the area.
void add_part(const RayNoise& part, double share, RayNoise& noise)
{
    noise.irradiance += share * part.irradiance;
    noise.variance += share * part.variance;
}

// Copies the texels of a patch.
void read_patch(const Canvas& canvas, const Patch& patch, std::size_t channels, const float* from, float* to)
{
    const std::size_t width = patch.surface->grid.width;
    for (std::size_t first = 0; first < patch.surface->samples(); first += width)
        std::copy_n(from + canvas.sample(patch, first) * channels, width * channels, to + first * channels);
}

std::vector<Canvas> canvases_of(const std::vector<Surface>& surfaces, const std::vector<ChannelMedium>& channels,
                                const BakeOptions& options)
{
    if (options.solver != Solver::fft)
        return canvases(surfaces, channels, 0);  // these sum over all pairs of texels, however far apart
    const std::size_t in_memory = options.max_moment_bytes / moment_bytes;
    return canvases(surfaces, channels, in_memory > 0 ? std::min(in_memory, canvas_texels) : canvas_texels);
}

}  // namespace

RaySettings BakeOptions::ray_settings(int ray_count) const
{
    return {.samples = samples,
            .rays = ray_count,
            .even_rays =
                std::clamp(ray_count / rays_per_even_ray, min_even_rays, std::max(max_even_rays, samples * samples)),
            .at_centers = at_centers,
            .seed = seed,
            .threads = threads,
            .noise = noise};
}

namespace {

void bake_surfaces(const std::vector<Surface>& surfaces, const std::vector<ArrivingLights>& lights,
                   const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                   const std::vector<float*>& luminance)
{
    const std::vector<Canvas> all = canvases_of(surfaces, channels, options);
    double texels = 0.0;
    double area = 0.0;
    for (const Canvas& canvas : all) {
        texels += static_cast<double>(canvas.samples());
        area += canvas.area;
    }
    for (const Surface& surface : surfaces)
        if (surface.grid.is_bent()) {
            texels += static_cast<double>(surface.samples());
            area += surface.grid.shape->area;
        }
    progress.set_total(std::max(texels, 1.0));
    Problem problem;
    problem.channels = channels;
    problem.solver = options.solver;
    problem.tolerance = options.tolerance;
    problem.threads = options.threads;
    problem.max_moment_bytes = options.max_moment_bytes;
    std::vector<float> values;
    for (const Canvas& canvas : all) {
        RayNoise noise;
        BakeOptions of_canvas = options;
        of_canvas.noise = options.noise ? &noise : nullptr;
        const std::size_t first = canvas.patches.front().index;
        const bool is_surface = canvas.is_alone() && !canvas.is_mirrored();
        values.resize(is_surface ? 0 : canvas.samples() * channels.size());
        float* const result = is_surface ? luminance[first] : values.data();
        progress.advance_by(static_cast<double>(canvas.samples()), [&](Progress& part) {
            if (options.solver == Solver::fft) {
                const EnteringColors entering(canvas);
                Problem colored = problem;
                colored.entering = entering.factors();
                bake_canvas(entering.canvas(), lights, of_canvas, std::move(colored), part, result);
            } else {
                bake_canvas(canvas, lights, of_canvas, problem, part, result);
            }
        });
        for (const Patch& patch : canvas.patches) {
            if (!is_surface)
                read_patch(canvas, patch, channels.size(), result, luminance[patch.index]);
            patch.surface->scale_by_color_out(channels.size(), luminance[patch.index]);
        }
        if (options.noise)
            add_part(noise, canvas.area / area, *options.noise);
    }
    if (options.bent_shares)
        options.bent_shares->assign(surfaces.size(), {});
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        const Surface& surface = surfaces[i];
        if (!surface.grid.is_bent())
            continue;
        RayNoise noise;
        BakeOptions of_surface = options;
        of_surface.noise = options.noise ? &noise : nullptr;
        std::vector<const SurfaceLight*> arriving;
        for (const std::optional<SurfaceLight>& light : lights[i])
            if (light)
                arriving.push_back(&*light);
        progress.advance_by(static_cast<double>(surface.samples()), [&](Progress& part) {
            const BentShares shares = bake_bent(surface, arriving, channels, of_surface, part, luminance[i]);
            if (options.bent_shares)
                (*options.bent_shares)[i] = shares;
        });
        surface.scale_by_color_out(channels.size(), luminance[i]);
        if (options.noise && area > 0.0)
            add_part(noise, surface.grid.shape->area / area, *options.noise);
    }
    progress.finish();
}

}  // namespace

void bake_luminance(const std::vector<Surface>& surfaces, const std::vector<ArrivingLights>& lights,
                    const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                    const std::vector<float*>& luminance)
{
    with_threads(options.threads, [&] { bake_surfaces(surfaces, lights, channels, options, progress, luminance); });
}

void bake_arrival(const Surface& surface, const std::vector<SurfaceLight>& lights, const BakeOptions& options,
                  Progress& progress, float* irradiance, float* flow)
{
    const Surface whole{.grid = surface.grid, .clearance = surface.clearance};
    std::fill_n(irradiance, 3 * whole.samples(), 0.0f);
    std::fill_n(flow, 3 * whole.samples(), 0.0f);
    progress.set_total(std::max<double>(1.0, static_cast<double>(lights.size())));
    for (const SurfaceLight& light : lights) {
        RaySum sum(whole.samples(), 3, true);
        progress.advance_by(
            1.0, [&](Progress& part) { light.gather(whole, options.ray_settings(options.rays), sum, part); });
        const double mean_color = std::accumulate(light.color.begin(), light.color.end(), 0.0) / 3.0;
        for (std::size_t i = 0; i < whole.samples(); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                irradiance[3 * i + c] += sum.irradiance[3 * i + c] * static_cast<float>(light.color[c]);
                flow[3 * i + c] += sum.flow[i][static_cast<int>(c)] * static_cast<float>(mean_color);
            }
    }
    progress.finish();
}

}  // namespace beamspread
