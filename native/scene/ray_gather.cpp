#include "scene/ray_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/pool.h"
#include "base/sobol.h"
#include "base/threads.h"
#include "scene/beams.h"
#include "scene/ray_start.h"

namespace beamspread {

namespace {

// More rays of a row than that are not kept at once: 50 MB of each thread for 8192 texels.
constexpr std::size_t max_rays_at_once = 256;

// From so many texels away on a texel's centre knows its mean to 5e-4 of the light of a point, and better of a larger one.
constexpr double texels_to_even_light = 24.0;

// One light's rays on one grid.
class RayGatherer {
public:
    RayGatherer(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                const RaySettings& settings)
        : m_grid(grid),
          m_prepared(light.facing(grid.normal)),
          m_light(m_prepared ? *m_prepared : light),
          m_occluders(occluders),
          m_rays(static_cast<std::size_t>(settings.rays)),
          m_sobol(m_rays, settings.seed),
          m_start(ray_start(grid, occluders, settings.clearance)),
          m_position_rounding(std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0)))
    {
        if (m_light.is_far())
            m_far_irradiance = m_light.irradiance(grid.origin, grid.normal);
    }

    void gather_row(std::size_t y, RaySink& sink)
    {
        const auto lease = m_rows.lend();
        for (std::size_t first = 0; first < m_rays; first += max_rays_at_once)
            gather_some(y, first, std::min(m_rays - first, max_rays_at_once), *lease, sink);
    }

private:
    // Of one row; the last four of one texel.
    struct Rays {
        std::vector<Vec3f> travel, irradiance;  // [ray * width + texel]
        // A packet that is being filled, and what its rays carry.
        std::array<ShadowRay, Occluders::packet_size> packet;
        std::array<Vec3f*, Occluders::packet_size> carried;
        std::size_t waiting = 0;
        std::vector<GridSobol::Point> places;
        std::vector<Vec3> points, weights;
        std::vector<LightRay> found;
    };

    void gather_some(std::size_t y, std::size_t first, std::size_t count, Rays& rays, RaySink& sink) const
    {
        rays.travel.assign(count * m_grid.width, Vec3f(0.0f, 0.0f, -1.0f));
        rays.irradiance.assign(count * m_grid.width, Vec3f(0.0f));
        rays.places.resize(count);
        rays.points.resize(count);
        rays.weights.resize(count);
        rays.found.resize(count);
        for (std::size_t x = 0; x < m_grid.width; ++x)
            gather_texel(x, y, first, rays);
        trace(rays);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t begin = i * m_grid.width;
            sink.add(
                {.y = y, .width = m_grid.width, .travel = &rays.travel[begin], .irradiance = &rays.irradiance[begin]});
        }
    }

    void gather_texel(std::size_t x, std::size_t y, std::size_t first, Rays& rays) const
    {
        const std::size_t count = rays.places.size();
        const Vec3 open = open_irradiance(x, y) * (static_cast<double>(count) / static_cast<double>(m_rays));
        if (open == Vec3(0.0))
            return;
        m_sobol.points(x, y, first, count, rays.places.data());
        Vec3 sum(0.0);
        for (std::size_t i = 0; i < count; ++i) {
            const GridSobol::Point& place = rays.places[i];
            rays.points[i] = m_grid.point(static_cast<double>(x) + place[2], static_cast<double>(y) + place[3]);
            const Vec2 on_light(place[0], place[1]);
            m_light.sample(rays.points[i], m_grid.normal, {&on_light, 1}, &rays.found[i]);
            const LightRay& found = rays.found[i];
            const double cos_theta = -glm::dot(found.travel, m_grid.normal);
            const bool counts = cos_theta > min_cos_theta && found.distance > m_position_rounding;
            rays.weights[i] = counts ? Vec3(found.flux) * cos_theta : Vec3(0.0);
            sum += rays.weights[i];
        }
        // The sum of what comes unhindered is known: what is hindered takes its part of it.
        const auto per_weight = [&](int channel) { return sum[channel] > 0.0 ? open[channel] / sum[channel] : 0.0; };
        const Vec3 scale(per_weight(0), per_weight(1), per_weight(2));
        for (std::size_t i = 0; i < count; ++i) {
            if (rays.weights[i] == Vec3(0.0))
                continue;
            const LightRay& found = rays.found[i];
            const std::size_t index = i * m_grid.width + x;
            rays.travel[index] = Vec3f(glm::normalize(m_grid.to_plane(found.travel)));
            rays.irradiance[index] = Vec3f(rays.weights[i] * scale);
            if (!m_occluders)
                continue;
            rays.packet[rays.waiting] = shadow_ray(m_grid, m_start, rays.points[i], found.travel, found.distance);
            rays.carried[rays.waiting] = &rays.irradiance[index];
            if (++rays.waiting == Occluders::packet_size)
                trace(rays);
        }
    }

    // Of a texel, in the mean, with nothing in between.
    Vec3 open_irradiance(std::size_t x, std::size_t y) const
    {
        if (m_light.is_far())
            return m_far_irradiance;
        const auto at = [&](double sub_x, double sub_y) {
            const Vec3 point = m_grid.point(static_cast<double>(x) + sub_x, static_cast<double>(y) + sub_y);
            return m_light.irradiance(point, m_grid.normal);
        };
        const double distance = m_light.distance_from(m_grid.point(static_cast<double>(x), static_cast<double>(y)));
        if (distance > texels_to_even_light * std::max(m_grid.pitch_x, m_grid.pitch_y))
            return at(0.5, 0.5);
        // The Gauss rule of two points along each axis.
        constexpr double offset = 0.5 / std::numbers::sqrt3;
        return 0.25 * (at(0.5 - offset, 0.5 - offset) + at(0.5 + offset, 0.5 - offset) +
                       at(0.5 - offset, 0.5 + offset) + at(0.5 + offset, 0.5 + offset));
    }

    void trace(Rays& rays) const
    {
        std::array<Vec3f, Occluders::packet_size> transmittance;
        if (rays.waiting > 0)
            m_occluders->transmit(std::span(rays.packet).first(rays.waiting), transmittance.data());
        for (std::size_t i = 0; i < rays.waiting; ++i)
            *rays.carried[i] *= transmittance[i];
        rays.waiting = 0;
    }

    const ReceiverGrid& m_grid;
    std::unique_ptr<const ExtendedLight> m_prepared;
    const ExtendedLight& m_light;
    const Occluders* m_occluders;
    std::size_t m_rays;
    GridSobol m_sobol;
    RayStart m_start;
    double m_position_rounding;
    Vec3 m_far_irradiance{0.0};
    Pool<Rays> m_rows;
};

}  // namespace

void gather_rays(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                 const RaySettings& settings, RaySink& sink, Progress& progress)
{
    grid.check();
    if (settings.rays < 1 || settings.rays > max_rays)
        reject("rays", settings.rays, "1 to " + std::to_string(max_rays));
    if (!(settings.clearance >= 0.0) || std::isinf(settings.clearance))
        reject("clearance", settings.clearance, "a finite length >= 0 in metres");

    progress.set_total(static_cast<double>(grid.height));
    const auto gather = [&] {
        RayGatherer gatherer(grid, light, occluders, settings);
        parallel_for(grid.height, [&](std::size_t y) {
            gatherer.gather_row(y, sink);
            progress.advance(1.0);
        });
    };
    with_threads(settings.threads, gather);
    progress.finish();
}

}  // namespace beamspread
