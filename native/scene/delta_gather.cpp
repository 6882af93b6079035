// Rays of lights without a size: one for each texel.
#include <algorithm>
#include <array>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

#include "base/threads.h"
#include "scene/ray_gather.h"
#include "scene/shadow_ray.h"
#include "scene/shadows.h"

namespace beamspread {

namespace {

// Distance to a point lamp, in texels, above which two Gauss points along each axis give the mean of a texel, to 2e-6.
// Higher values are slower and more exact.
constexpr double texels_to_smooth_lamp = 16.0;

// Points of a texel relative to its corner in the world, n x n: one in each cell of an n x n grid and one in each of n^2
// columns and n^2 rows, so that a shadow's border along the texels is resolved as finely as an oblique one (Chiu,
// Shirley, Wang 1994, "Multi-jittered sampling", without the jitter).
std::vector<Vec3> sub_texel_points(const ReceiverGrid& grid, int samples)
{
    std::vector<Vec3> points;
    for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i)
            points.push_back(grid.step((i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples));
    }
    return points;
}

std::vector<Vec3> gauss_points(const ReceiverGrid& grid)
{
    const double offset = 0.5 / std::numbers::sqrt3;
    std::vector<Vec3> points;
    for (const double y : {0.5 - offset, 0.5 + offset})
        for (const double x : {0.5 - offset, 0.5 + offset})
            points.push_back(grid.step(x, y));
    return points;
}

// Casts rays only from texels that `Shadows` can't decide.
class DeltaGatherer {
public:
    DeltaGatherer(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const RaySettings& settings)
        : m_grid(grid),
          m_light(light),
          m_source(*light.source()),
          m_occluders(occluders),
          m_with_travel(settings.with_travel),
          m_points(sub_texel_points(grid, settings.samples)),
          m_smooth_points(gauss_points(grid)),
          m_smooth_from(texels_to_smooth_lamp * std::max(grid.pitch_x, grid.pitch_y)),
          m_rays(grid, occluders, settings.clearance),
          m_shadows(grid, m_source, occluders, m_rays.start(), settings.find_shadows),
          m_sums(settings.noise ? grid.height : 0)
    {
        const Texel open = gather_texel(0.0, 0.0, m_points, nullptr);
        m_open_irradiance = Vec3f(open.irradiance);
        m_far_travel = mean_direction(open.flow);
    }

    std::size_t bands() const { return m_shadows.bands(); }

    // Mean irradiance of all texels and channels, W/m^2, if noise is asked for.
    double mean() const
    {
        return std::accumulate(m_sums.begin(), m_sums.end(), 0.0) /
               (3.0 * static_cast<double>(m_grid.width * m_grid.height));
    }

    // Hands the rays of a band of rows to the sink; returns their number.
    std::size_t gather_band(std::size_t band, RaySink& sink)
    {
        Work& work = m_work.local();
        m_shadows.shade_band(band, work.shades);
        work.irradiance.resize(m_grid.width);
        work.travel.assign(m_grid.width, m_far_travel);
        const std::size_t rows = work.shades.size() / m_grid.width;
        for (std::size_t i = 0; i < rows; ++i)
            gather_row(band * Shadows::rows_per_band + i, &work.shades[i * m_grid.width], work, sink);
        return rows;
    }

private:
    struct Texel {
        Vec3 irradiance{0.0};
        Vec3 flow{0.0};          // sum over the points of mean irradiance times direction of travel
        bool is_shaded = false;  // true if any point is
    };

    // Working memory of a thread.
    struct Work {
        std::vector<Shade> shades;  // of a band
        std::vector<Vec3f> travel, irradiance;
    };

    void gather_row(std::size_t y, const Shade* shades, Work& work, RaySink& sink)
    {
        const bool travel_varies = m_with_travel && !m_source.is_far;
        for (std::size_t x = 0; x < m_grid.width; ++x) {
            if (m_source.is_far && shades[x] == Shade::none) {
                work.irradiance[x] = m_open_irradiance;
                continue;
            }
            const Texel gathered = texel(static_cast<double>(x), static_cast<double>(y), shades[x]);
            work.irradiance[x] = Vec3f(gathered.irradiance);
            if (travel_varies)
                work.travel[x] = mean_direction(gathered.flow);
        }
        if (!m_sums.empty())
            for (const Vec3f& light : work.irradiance)
                m_sums[y] += static_cast<double>(light.x + light.y + light.z);
        sink.add({.sample = y * m_grid.width,
                  .count = m_grid.width,
                  .ray = 0,
                  .travel = m_with_travel ? work.travel.data() : nullptr,
                  .irradiance = work.irradiance.data()});
    }

    Texel texel(double x, double y, Shade shade) const
    {
        if (shade == Shade::full)
            return {};
        if (shade == Shade::unknown) {
            const Texel traced = gather_texel(x, y, m_points, m_occluders);
            return traced.is_shaded || !is_smooth(x, y) ? traced : gather_texel(x, y, m_smooth_points, nullptr);
        }
        return gather_texel(x, y, is_smooth(x, y) ? m_smooth_points : m_points, nullptr);
    }

    // True if open light is so even within a texel that few points give its mean.
    bool is_smooth(double x, double y) const
    {
        const Vec3 away = m_source.position - m_grid.point(x, y);
        return m_source.is_smooth && m_points.size() > m_smooth_points.size() &&
               glm::dot(away, away) > m_smooth_from * m_smooth_from;
    }

    Texel gather_texel(double x, double y, std::span<const Vec3> steps, const Occluders* occluders) const
    {
        const Vec3 corner = m_grid.point(x, y);
        Texel sum;
        for (std::size_t first = 0; first < steps.size(); first += Occluders::packet_size) {
            const auto packet = steps.subspan(first, std::min(steps.size() - first, Occluders::packet_size));
            if (occluders)
                add_traced(corner, packet, *occluders, sum);
            else
                add_open(corner, packet, sum);
        }
        sum.irradiance /= static_cast<double>(steps.size());
        return sum;
    }

    using Points = std::array<Vec3, Occluders::packet_size>;
    using Rays = std::array<LightRay, Occluders::packet_size>;

    void sample(const Vec3& corner, std::span<const Vec3> steps, Points& points, Rays& rays) const
    {
        for (std::size_t i = 0; i < steps.size(); ++i)
            points[i] = corner + steps[i];
        m_light.sample(std::span(points).first(steps.size()), m_grid.normal, {}, rays.data());
    }

    // Irradiance of a ray, the same in all channels: the light is white.
    double irradiance(const LightRay& ray) const
    {
        return static_cast<double>(ray.flux.x) * m_rays.arriving_cosine(ray);
    }

    // Adds the light of points where nothing blocks it.
    void add_open(const Vec3& corner, std::span<const Vec3> steps, Texel& sum) const
    {
        Points points;
        Rays rays;
        sample(corner, steps, points, rays);
        double white = sum.irradiance.x;
        Vec3 flow = sum.flow;
        for (std::size_t i = 0; i < steps.size(); ++i) {
            const double arriving = irradiance(rays[i]);
            if (!(arriving > 0.0))
                continue;
            white += arriving;
            flow += arriving * rays[i].travel;
        }
        sum.irradiance = Vec3(white);
        sum.flow = flow;
    }

    // Adds the light of points that gets past the occluders.
    void add_traced(const Vec3& corner, std::span<const Vec3> steps, const Occluders& occluders, Texel& sum) const
    {
        Points points;
        Rays rays;
        sample(corner, steps, points, rays);
        std::array<double, Occluders::packet_size> arriving;
        std::array<ShadowRay, Occluders::packet_size> shadow_rays;
        std::size_t count = 0;
        for (std::size_t i = 0; i < steps.size(); ++i) {
            arriving[count] = irradiance(rays[i]);
            if (!(arriving[count] > 0.0))
                continue;
            shadow_rays[count] = m_rays.shadow_ray(points[i], rays[i]);
            rays[count].travel = rays[i].travel;
            ++count;
        }
        sum.is_shaded |= count < steps.size();
        std::array<Vec3f, Occluders::packet_size> transmittance;
        occluders.transmit(std::span(shadow_rays).first(count), transmittance.data());
        Texel result = sum;
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3 passed(transmittance[i]);
            const double mean = occluders.is_colored() ? (passed.x + passed.y + passed.z) / 3.0 : passed.x;
            result.is_shaded |= passed != Vec3(1.0);
            result.irradiance += arriving[i] * passed;
            result.flow += arriving[i] * mean * rays[i].travel;
        }
        sum = result;
    }

    Vec3f mean_direction(const Vec3& flow) const
    {
        const bool is_lit = glm::dot(flow, flow) > 0.0;
        return is_lit ? Vec3f(glm::normalize(m_grid.to_plane(flow))) : Vec3f(0.0f, 0.0f, -1.0f);
    }

    const ReceiverGrid& m_grid;
    const Light& m_light;
    LightSource m_source;
    const Occluders* m_occluders;
    bool m_with_travel;
    std::vector<Vec3> m_points;
    std::vector<Vec3> m_smooth_points;
    double m_smooth_from;  // distance to a lamp, metres
    ReceiverRays m_rays;
    Shadows m_shadows;
    // Irradiance and travel at texel (0, 0) where nothing blocks the light: those of all texels, if it is infinitely far.
    Vec3f m_open_irradiance, m_far_travel;
    std::vector<double> m_sums;  // [row] irradiance of texels and channels; empty unless noise is asked for
    PerThread<Work> m_work;
};

}  // namespace

void detail::gather_delta_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                               const RaySettings& settings, RaySink& sink, Progress& progress)
{
    progress.set_total(static_cast<double>(grid.height));
    DeltaGatherer gatherer(grid, light, occluders, settings);
    parallel_for(gatherer.bands(),
                 [&](std::size_t band) { progress.advance(static_cast<double>(gatherer.gather_band(band, sink))); });
    if (settings.noise)
        settings.noise->add({.irradiance = gatherer.mean()}, 1.0);
}

}  // namespace beamspread
