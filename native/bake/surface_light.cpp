#include "bake/surface_light.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

namespace beamspread {

namespace {

// Passes on the part of each ray that the surface lets in.
class ReceivedRays final : public RaySink {
public:
    ReceivedRays(const Surface& surface, RaySink& next) : m_surface(surface), m_next(next) {}

    void add(const RayRun& run) override
    {
        std::vector<Vec3f>& received = m_scratch.local();
        received.assign(run.irradiance, run.irradiance + run.count);
        for (std::size_t i = 0; i < run.count && m_surface.coverage && !m_surface.grid.is_bent(); ++i)
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
    settings.clearance = surface.clearance;
    gather_rays(surface.grid, *light, occluders, settings, sink, progress);
    if (sum)
        sum->add(noise, std::accumulate(color.begin(), color.end(), 0.0) / static_cast<double>(color.size()));
}

RaySum::RaySum(std::size_t samples, std::size_t channel_count, bool with_flow)
    : channels(channel_count), irradiance(channel_count * samples), flow(with_flow ? samples : 0)
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

}  // namespace beamspread
