#include "bake/smooth_rays.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

// Texels along a side of a square plane that rays are traced from, at least as many on each of several, and rays of each of
// two estimates. Larger: more terms are found to have no light but noise.
constexpr std::size_t texels_along_side = 32;
constexpr std::size_t min_texels_along_side = 4;
constexpr int rays_of_estimate = 64;

// Stores all rays of texels.
class RayStore final : public RaySink {
public:
    RayStore(std::size_t texels, std::size_t rays, const std::vector<double>& color) : m_color(color)
    {
        rays_of.texels = texels;
        rays_of.travel.resize(texels * rays, Vec3f(0.0f, 0.0f, -1.0f));
        rays_of.irradiance.resize(texels * rays);
    }

    void add(const RayRun& run) override
    {
        const std::size_t first = run.ray * rays_of.texels + run.sample;
        std::copy_n(run.travel, run.count, rays_of.travel.begin() + static_cast<std::ptrdiff_t>(first));
        for (std::size_t i = 0; i < run.count; ++i) {
            const Vec3 light = Vec3(run.irradiance[i]) * Vec3(m_color[0], m_color[1], m_color[2]);
            rays_of.irradiance[first + i] = static_cast<float>((light.x + light.y + light.z) / 3.0);
        }
    }

    TexelRays rays_of;

private:
    const std::vector<double>& m_color;
};

}  // namespace

SmoothLight smooth_rays(const Surface& surface, const SurfaceLight& light, double share, RaySettings settings,
                        Progress& progress)
{
    const Surface coarse = surface.coarse(share, texels_along_side, min_texels_along_side);
    settings.rays = rays_of_estimate;
    settings.even_rays = 0;
    settings.noise = nullptr;
    progress.set_total(2.0);
    RayStore first(coarse.samples(), rays_of_estimate, light.color);
    progress.advance_by(1.0, [&](Progress& part) { light.gather(coarse, settings, first, part); });
    RayStore second(coarse.samples(), rays_of_estimate, light.color);
    settings.seed += 1;
    progress.advance_by(1.0, [&](Progress& part) { light.gather(coarse, settings, second, part); });
    progress.finish();
    return {first.rays_of, second.rays_of};
}

}  // namespace beamspread
