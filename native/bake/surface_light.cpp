#include "bake/surface_light.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

namespace beamspread {

namespace {

// Flow, W/m^2, below which single precision holds no direction.
constexpr double min_flow = 1e-30;

// Passes on the part of each ray that the surface lets in.
class ReceivedRays final : public RaySink {
public:
    ReceivedRays(const Surface& surface, RaySink& next) : m_surface(surface), m_next(next) {}

    void add(const RayRun& run) override
    {
        std::vector<Vec3f>& received = m_scratch.local();
        received.assign(run.irradiance, run.irradiance + run.count);
        for (std::size_t i = 0; i < run.count && m_surface.coverage; ++i)
            received[i] *= m_surface.coverage[run.sample + i];
        for (std::size_t i = 0; i < run.count && m_surface.color_in; ++i) {
            const float* color = m_surface.color_in + 3 * (run.sample + i);
            received[i] *= Vec3f(color[0], color[1], color[2]);
        }
        RayRun part = run;
        part.irradiance = received.data();
        m_next.add(part);
    }

private:
    const Surface& m_surface;
    RaySink& m_next;
    PerThread<std::vector<Vec3f>> m_scratch;
};

// Stores each ray of a texel.
class RayLayers final : public RaySink {
public:
    RayLayers(const ReceiverGrid& grid, std::size_t rays, bool with_travel)
        : irradiance(rays, std::vector<float>(3 * grid.width * grid.height)),
          travel(with_travel ? rays : 0, std::vector<float>(3 * grid.width * grid.height))
    {
    }

    void add(const RayRun& run) override
    {
        copy(run.irradiance, run, irradiance[run.ray]);
        if (!travel.empty())
            copy(run.travel, run, travel[run.ray]);
    }

    std::vector<std::vector<float>> irradiance, travel;  // [ray][texel and channel, or x, y, z]

private:
    static void copy(const Vec3f* values, const RayRun& run, std::vector<float>& to)
    {
        static_assert(sizeof(Vec3f) == 3 * sizeof(float));
        std::copy_n(&values->x, 3 * run.count, to.data() + 3 * run.sample);
    }
};

double mean_of(const PlaneLight& light)
{
    double sum = 0.0;
    for (std::size_t y = 0; y < light.irradiance.height; ++y)
        for (std::size_t x = 0; x < light.irradiance.width; ++x)
            sum += static_cast<double>(light.irradiance(y, x));
    const double texels = static_cast<double>(light.irradiance.height * light.irradiance.width);
    return sum * std::accumulate(light.color.begin(), light.color.end(), 0.0) /
           (texels * static_cast<double>(light.color.size()));
}

}  // namespace

bool SurfaceLight::is_colored(const Surface& surface) const
{
    return surface.color_in || field || light->is_colored() || (occluders && occluders->is_colored());
}

std::optional<Directions> SurfaceLight::directions(const ReceiverGrid& grid) const
{
    if (field)
        return field->lobes() == 1 ? std::optional(field->directions(0)) : std::nullopt;
    const std::optional<LightSource> source = light->source();
    if (!source)
        return std::nullopt;
    if (source->is_far) {
        // Rounded to single precision, as directions of rays are.
        const Vec3 travel(Vec3f(glm::normalize(grid.to_plane(-source->position))));
        return OneDirection{travel.z < 0.0 ? travel : Vec3(0.0, 0.0, -1.0)};  // else the plane is dark
    }
    return FromPoint{grid.to_plane(source->position - grid.origin)};
}

void SurfaceLight::gather(const Surface& surface, const RaySettings& settings, RaySink& sink, Progress& progress,
                          bool all) const
{
    ReceivedRays received(surface, sink);
    if (field)
        field->gather(surface.grid, settings.threads, all, received, progress);
    else
        gather_lamp(surface, settings, received, progress);
}

void SurfaceLight::gather_lamp(const Surface& surface, RaySettings settings, RaySink& sink, Progress& progress) const
{
    RayNoise* const sum = std::exchange(settings.noise, nullptr);
    RayNoise noise;
    if (sum)
        settings.noise = &noise;
    gather_rays(surface.grid, *light, occluders, settings, sink, progress);
    if (sum)
        sum->add(noise, std::accumulate(color.begin(), color.end(), 0.0) / static_cast<double>(color.size()));
}

RaySum::RaySum(const ReceiverGrid& grid, std::size_t channel_count, bool with_flow)
    : channels(channel_count),
      irradiance(channel_count * grid.width * grid.height),
      flow(with_flow ? grid.width * grid.height : 0)
{
}

void RaySum::add(const RayRun& run)
{
    for (std::size_t i = 0; i < run.count; ++i) {
        const Vec3f& light = run.irradiance[i];
        float* sum = irradiance.data() + channels * (run.sample + i);
        sum[0] += light.x;
        if (channels == 3) {
            sum[1] += light.y;
            sum[2] += light.z;
        }
        if (!flow.empty())
            flow[run.sample + i] += (light.x + light.y + light.z) / 3.0f * run.travel[i];
    }
}

void StoredLight::add(const ReceiverGrid& grid, std::vector<float> irradiance, std::size_t channels,
                      const Directions& directions, const std::vector<double>& color)
{
    if (std::ranges::all_of(irradiance, [](float value) { return value == 0.0f; }))
        return;
    const auto stride = static_cast<std::ptrdiff_t>(channels);
    if (channels > 1)
        for (std::size_t i = 0; i < irradiance.size(); ++i)
            irradiance[i] *= static_cast<float>(color[i % channels]);
    const std::vector<float>& values = arrays.emplace_back(std::move(irradiance));
    std::vector<View2D<const float>> views;
    for (std::size_t c = 0; c < channels; ++c)
        views.push_back(
            {values.data() + c, grid.height, grid.width, static_cast<std::ptrdiff_t>(grid.width) * stride, stride});
    if (channels == 1) {
        lights.push_back({views[0], directions, color});
    } else {
        for (PlaneLight& light : lights_of_channels(views, directions))
            lights.push_back(std::move(light));
    }
    std::erase_if(lights, [](const PlaneLight& light) {
        return std::ranges::all_of(light.color, [](double factor) { return factor == 0.0; });
    });
}

void StoredLight::add_one_direction(const Surface& surface, const SurfaceLight& light, const RaySettings& settings,
                                    Progress& progress)
{
    const bool is_colored = light.is_colored(surface);
    const Directions directions = *light.directions(surface.grid);
    if (is_colored && std::holds_alternative<FromPoint>(directions)) {
        add_mean_direction(surface, light, settings, progress);
        return;
    }
    RaySum sum(surface.grid, is_colored ? 3 : 1, false);
    RaySettings without_travel = settings;
    without_travel.with_travel = false;
    light.gather(surface, without_travel, sum, progress);
    add(surface.grid, std::move(sum.irradiance), sum.channels, directions, light.color);
}

void StoredLight::add_rays(const Surface& surface, const SurfaceLight& light, const RaySettings& settings,
                           Progress& progress)
{
    const std::size_t rays = light.field ? light.field->lobes() : static_cast<std::size_t>(settings.rays);
    RayLayers layers(surface.grid, rays, light.light != nullptr);
    light.gather(surface, settings, layers, progress);
    for (std::size_t i = 0; i < rays; ++i) {
        if (light.field) {
            add(surface.grid, std::move(layers.irradiance[i]), 3, light.field->directions(i), light.color);
        } else {
            const std::vector<float>& travel = arrays.emplace_back(std::move(layers.travel[i]));
            add(surface.grid, std::move(layers.irradiance[i]), 3, PerTexel{travel.data()}, light.color);
        }
    }
}

void StoredLight::add_mean_direction(const Surface& surface, const SurfaceLight& light, const RaySettings& settings,
                                     Progress& progress)
{
    RaySum sum(surface.grid, 3, true);
    light.gather(surface, settings, sum, progress);
    std::vector<float>& travel = arrays.emplace_back(3 * surface.samples());
    for (std::size_t i = 0; i < surface.samples(); ++i) {
        // In double precision: squares of 1e-22 have no digits in single.
        const Vec3 flow(sum.flow[i]);
        const double length = glm::length(flow);
        const Vec3 direction = length > min_flow ? flow / length : Vec3(0.0, 0.0, -1.0);
        for (int k = 0; k < 3; ++k)
            travel[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(direction[k]);
    }
    const Directions directions = PerTexel{travel.data()};
    add(surface.grid, std::move(sum.irradiance), 3, directions, light.color);
}

double StoredLight::mean() const
{
    double sum = 0.0;
    for (const PlaneLight& light : lights)
        sum += mean_of(light);
    return sum;
}

}  // namespace beamspread
