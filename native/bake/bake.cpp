#include "bake/bake.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "bake/field_bake.h"
#include "simd/loops.h"
#include "solve/solve.h"

namespace beamspread {

namespace {

// Rays of a texel for each ray of its first pass (`RaySettings::even_rays`), and bounds of the latter. More rays of the
// first pass are slower and miss fewer shadows.
constexpr int rays_per_even_ray = 8;
constexpr int min_even_rays = 4;
constexpr int max_even_rays = 16;

// Luminance of lights whose irradiance is stored before the solver begins. Lights of many rays, which `direct` and
// `adaptive` solve ray by ray, are stored one after the other.
void bake_stored(const Surface& surface, const std::vector<SurfaceLight>& lights, const BakeOptions& options,
                 Problem problem, Progress& progress, float* luminance)
{
    const auto has_one_direction = [&](const SurfaceLight& light) {
        return light.directions(surface.grid).has_value();
    };
    const std::size_t group_size =
        std::ranges::all_of(lights, has_one_direction) ? std::max<std::size_t>(lights.size(), 1) : 1;
    const std::size_t groups = lights.size() / group_size;
    const std::size_t values = problem.plane.texels() * problem.channels.size();
    progress.set_total(light_work * static_cast<double>(lights.size()) + solver_work);
    std::fill_n(luminance, values, 0.0f);
    std::vector<float> part_of_sum;  // luminance of a group beside the first
    for (std::size_t group = 0; group < groups; ++group) {
        StoredLight stored;
        for (std::size_t i = group * group_size; i < (group + 1) * group_size; ++i)
            progress.advance_by(light_work, [&](Progress& part) {
                RaySettings settings = options.ray_settings(surface, options.rays);
                if (has_one_direction(lights[i])) {
                    stored.add_one_direction(surface, lights[i], settings, part);
                } else {
                    settings.even_rays = 0;
                    stored.add_rays(surface, lights[i], settings, part);
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

}  // namespace

RaySettings BakeOptions::ray_settings(const Surface& surface, int ray_count) const
{
    return {.samples = samples,
            .rays = ray_count,
            .even_rays = std::clamp(ray_count / rays_per_even_ray, min_even_rays, max_even_rays),
            .seed = seed,
            .clearance = surface.clearance,
            .threads = threads,
            .noise = noise};
}

void bake_luminance(const Surface& surface, const std::vector<SurfaceLight>& lights,
                    const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                    float* luminance)
{
    Problem problem;
    problem.plane = surface.plane();
    problem.channels = channels;
    problem.solver = options.solver;
    problem.tolerance = options.tolerance;
    problem.threads = options.threads;
    problem.max_moment_bytes = options.max_moment_bytes;
    const bool has_one_direction_each = std::ranges::all_of(
        lights, [&](const SurfaceLight& light) { return light.directions(surface.grid).has_value(); });
    const bool fits = lights.size() * surface.samples() * sizeof(float) <= options.max_stored_bytes;
    if (options.solver != Solver::fft || (has_one_direction_each && fits))
        bake_stored(surface, lights, options, std::move(problem), progress, luminance);
    else
        bake_by_field(surface, lights, options, std::move(problem), progress, luminance);
    surface.scale_by_color_out(channels.size(), luminance);
    progress.finish();
}

void bake_arrival(const Surface& surface, const std::vector<SurfaceLight>& lights, const BakeOptions& options,
                  Progress& progress, float* irradiance, float* flow)
{
    const Surface whole{.grid = surface.grid, .clearance = surface.clearance};
    std::fill_n(irradiance, 3 * whole.samples(), 0.0f);
    std::fill_n(flow, 3 * whole.samples(), 0.0f);
    progress.set_total(std::max<double>(1.0, static_cast<double>(lights.size())));
    for (const SurfaceLight& light : lights) {
        RaySum sum(whole.grid, 3, true);
        progress.advance_by(
            1.0, [&](Progress& part) { light.gather(whole, options.ray_settings(whole, options.rays), sum, part); });
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
