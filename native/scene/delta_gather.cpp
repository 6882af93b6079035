// Rays of lights without a size: one for each texel.
#include <algorithm>
#include <array>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

#include "base/threads.h"
#include "scene/even_tiles.h"
#include "scene/ray_gather.h"
#include "scene/shadow_ray.h"
#include "scene/shadows.h"

namespace beamspread {

namespace {

// Distance to a point lamp, in texels, above which two Gauss points along each axis give the mean of a texel, to 2e-6.
// Higher values are slower and more exact.
constexpr double texels_to_smooth_lamp = 16.0;

// Points of a texel on a mesh that bends from which on the first rays of tiles tell how the others go. Fewer are traced as
// fast without.
constexpr std::size_t least_even_points = 8;

// A point of a texel: its place in the unit square, and on a plane the step from the texel's corner in the world.
struct SubTexel {
    Vec2 place;
    Vec3 step;
};

SubTexel sub_texel(const ReceiverGrid& grid, double x, double y)
{
    return {{x, y}, grid.is_bent() ? Vec3(0.0) : grid.step(x, y)};
}

// Points of a texel, n x n: one in each cell of an n x n grid and one in each of n^2
// columns and n^2 rows, so that a shadow's border along the texels is resolved as finely as an oblique one (Chiu,
// Shirley, Wang 1994, "Multi-jittered sampling", without the jitter).
std::vector<SubTexel> sub_texel_points(const ReceiverGrid& grid, int samples)
{
    std::vector<SubTexel> points;
    for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i)
            points.push_back(sub_texel(grid, (i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples));
    }
    return points;
}

std::vector<SubTexel> gauss_points(const ReceiverGrid& grid)
{
    const double offset = 0.5 / std::numbers::sqrt3;
    std::vector<SubTexel> points;
    for (const double y : {0.5 - offset, 0.5 + offset})
        for (const double x : {0.5 - offset, 0.5 + offset})
            points.push_back(sub_texel(grid, x, y));
    return points;
}

std::vector<Vec2> places(std::span<const SubTexel> points)
{
    std::vector<Vec2> all;
    for (const SubTexel& point : points)
        all.push_back(point.place);
    return all;
}

// Casts rays only from texels that neither `Shadows` nor `EvenTiles` decide.
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
          m_rays(grid, occluders, settings.clearance),
          m_shadows(grid, m_source, occluders, m_rays.start(), settings.find_shadows),
          m_sums(settings.noise ? grid.height : 0)
    {
        if (grid.is_bent()) {
            if (occluders && settings.find_shadows && m_points.size() >= least_even_points)
                m_even_tiles = EvenTiles(grid, light, *occluders, m_rays, places(m_points));
            return;
        }
        const Texel open = gather_texel(0, 0, m_points, nullptr);
        m_open_irradiance = Vec3f(open.irradiance);
        m_far_travel = mean_direction(0, open.flow);
    }

    std::size_t bands() const { return m_shadows.bands(); }

    // Mean irradiance of all receiving texels and channels, W/m^2, if noise is asked for.
    double mean() const
    {
        const double texels = static_cast<double>(std::max<std::size_t>(m_grid.receiving(), 1));
        return std::accumulate(m_sums.begin(), m_sums.end(), 0.0) / (3.0 * texels);
    }

    // Hands the rays of a band of rows to the sink; returns their number.
    std::size_t gather_band(std::size_t band, RaySink& sink)
    {
        Work& work = m_work.local();
        m_shadows.shade_band(band, work.shades);
        if (m_grid.is_bent())
            for (std::size_t i = 0; i < work.shades.size(); ++i)
                if (work.shades[i] == Shade::unknown)
                    work.shades[i] =
                        m_even_tiles.shade(i % m_grid.width, band * Shadows::rows_per_band + i / m_grid.width);
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
        const bool is_same = m_source.is_far && !m_grid.is_bent();
        for (std::size_t x = 0; x < m_grid.width; ++x) {
            if (is_same && shades[x] == Shade::none) {
                work.irradiance[x] = m_open_irradiance;
                continue;
            }
            const Texel gathered = texel(x, y, shades[x]);
            work.irradiance[x] = Vec3f(gathered.irradiance);
            if (m_with_travel && !is_same)
                work.travel[x] = mean_direction(y * m_grid.width + x, gathered.flow);
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

    Texel texel(std::size_t x, std::size_t y, Shade shade) const
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
    bool is_smooth(std::size_t x, std::size_t y) const
    {
        const Vec3 away = m_source.position - m_grid.point(static_cast<double>(x), static_cast<double>(y));
        const double smooth_from = texels_to_smooth_lamp * m_grid.pitch_at(y * m_grid.width + x);
        return m_source.is_smooth && m_points.size() > m_smooth_points.size() &&
               glm::dot(away, away) > smooth_from * smooth_from;
    }

    // A texel whose light is gathered.
    struct At {
        std::size_t texel;
        Vec2 position;  // texels
        Vec3 corner;    // world
    };

    Texel gather_texel(std::size_t x, std::size_t y, std::span<const SubTexel> points, const Occluders* occluders) const
    {
        Texel sum;
        const std::size_t texel = y * m_grid.width + x;
        if (m_grid.is_bent() && !m_grid.bent_texel(texel).is_inside())
            return sum;
        const Vec2 position(static_cast<double>(x), static_cast<double>(y));
        const At at{texel, position, m_grid.point(position.x, position.y)};
        for (std::size_t first = 0; first < points.size(); first += Occluders::packet_size) {
            const auto packet = points.subspan(first, std::min(points.size() - first, Occluders::packet_size));
            if (occluders)
                add_traced(at, packet, *occluders, sum);
            else
                add_open(at, packet, sum);
        }
        sum.irradiance /= static_cast<double>(points.size());
        return sum;
    }

    using Points = std::array<Vec3, Occluders::packet_size>;
    using Rays = std::array<LightRay, Occluders::packet_size>;

    void sample(const At& at, std::span<const SubTexel> in_texel, Points& points, Rays& rays) const
    {
        for (std::size_t i = 0; i < in_texel.size(); ++i)
            points[i] = m_grid.is_bent() ? m_grid.bent_texel(at.texel).point(in_texel[i].place.x, in_texel[i].place.y)
                                         : at.corner + in_texel[i].step;
        m_light.sample(std::span(points).first(in_texel.size()), m_grid.normal_at(at.texel), {}, rays.data());
    }

    // Irradiance of a ray, the same in all channels: the light is white.
    double irradiance(std::size_t texel, const LightRay& ray) const
    {
        return m_rays.is_behind_face(texel, ray) ? 0.0
                                                 : static_cast<double>(ray.flux.x) * m_rays.arriving_cosine(texel, ray);
    }

    // Adds the light of points where nothing blocks it.
    void add_open(const At& at, std::span<const SubTexel> in_texel, Texel& sum) const
    {
        Points points;
        Rays rays;
        sample(at, in_texel, points, rays);
        double white = sum.irradiance.x;
        Vec3 flow = sum.flow;
        for (std::size_t i = 0; i < in_texel.size(); ++i) {
            const double arriving = irradiance(at.texel, rays[i]);
            if (!(arriving > 0.0))
                continue;
            white += arriving;
            flow += arriving * rays[i].travel;
        }
        sum.irradiance = Vec3(white);
        sum.flow = flow;
    }

    // Adds the light of points that gets past the occluders.
    void add_traced(const At& at, std::span<const SubTexel> in_texel, const Occluders& occluders, Texel& sum) const
    {
        Points points;
        Rays rays;
        sample(at, in_texel, points, rays);
        std::array<double, Occluders::packet_size> arriving;
        std::array<ShadowRay, Occluders::packet_size> shadow_rays;
        std::size_t count = 0;
        for (std::size_t i = 0; i < in_texel.size(); ++i) {
            arriving[count] = irradiance(at.texel, rays[i]);
            if (!(arriving[count] > 0.0))
                continue;
            shadow_rays[count] = m_rays.shadow_ray(at.texel, points[i], rays[i]);
            rays[count].travel = rays[i].travel;
            ++count;
        }
        sum.is_shaded |= count < in_texel.size();
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

    Vec3f mean_direction(std::size_t texel, const Vec3& flow) const
    {
        const bool is_lit = glm::dot(flow, flow) > 0.0;
        return is_lit ? Vec3f(glm::normalize(m_grid.to_tangent(texel, flow))) : Vec3f(0.0f, 0.0f, -1.0f);
    }

    const ReceiverGrid& m_grid;
    const Light& m_light;
    LightSource m_source;
    const Occluders* m_occluders;
    bool m_with_travel;
    std::vector<SubTexel> m_points;
    std::vector<SubTexel> m_smooth_points;
    ReceiverRays m_rays;
    Shadows m_shadows;
    EvenTiles m_even_tiles;  // where the grid bends
    // Irradiance and travel at texel (0, 0) where nothing blocks the light: those of all texels of a plane, if it is
    // infinitely far.
    Vec3f m_open_irradiance{0.0f}, m_far_travel{0.0f, 0.0f, -1.0f};
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
