#include "scene/ray_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/sobol.h"
#include "base/threads.h"
#include "base/vec.h"
#include "scene/beams.h"
#include "scene/checks.h"
#include "scene/open_irradiance.h"
#include "scene/ray_start.h"

namespace beamspread {

namespace {

// Texels of a row, and rays of each, that are kept at once: 400 kB, for the processor's cache.
constexpr std::size_t texels_at_once = 64;
constexpr std::size_t max_rays_at_once = 256;

// What the rays of a texel met.
enum Met : std::uint8_t { nothing = 0, light = 1, obstacle = 2, both = light | obstacle };

// How often rays are moved on where none finds the light: with half as many, 6 of 416 texels that a narrow lamp just
// reaches stay dark, 1e-5 of its light, with twice as many none as with these. And how far: a lattice of four dimensions (Roberts 2018, "The
// unreasonable effectiveness of quasirandom sequences").
constexpr int max_trials = 64;
constexpr Vec2 step_on_light(0.8566748838545029, 0.7338918566271259);
constexpr Vec2 step_in_texel(0.6287067210378086, 0.5385972572236101);

// One light's rays on one grid.
class RayGatherer {
public:
    RayGatherer(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                const RaySettings& settings)
        : m_grid(grid),
          m_prepared(light.facing(grid.normal)),
          m_light(m_prepared ? *m_prepared : light),
          m_open(grid, m_light),
          m_is_far(std::isinf(m_light.distance_from(grid.origin))),
          m_occluders(occluders),
          m_rays(static_cast<std::size_t>(settings.rays)),
          m_even_rays(occluders ? std::min(static_cast<std::size_t>(settings.even_rays), m_rays) : 0),
          m_sobol(m_rays, settings.seed),
          m_even_sobol(std::max<std::size_t>(m_even_rays, 1), settings.seed),
          m_start(ray_start(grid, occluders, settings.clearance)),
          m_position_rounding(std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0)))
    {
        if (takes_a_look())
            m_met.resize(grid.width * grid.height);
    }

    bool takes_a_look() const { return m_even_rays > 0 && m_even_rays < m_rays; }

    // Has a look at a row, for itself and for its neighbours.
    void look_at_row(std::size_t y)
    {
        Rays& rays = m_rows.local();
        for (std::size_t x = 0; x < m_grid.width; x += texels_at_once) {
            const Span span{y, x, std::min(texels_at_once, m_grid.width - x)};
            rays.start(m_even_rays, span);
            for (std::size_t i = 0; i < span.width; ++i)
                gather_texel(i, {m_even_sobol, 0, m_even_rays, m_even_rays, true}, rays);
            trace(rays);
            std::copy(rays.met.begin(), rays.met.end(), met_in(y) + static_cast<std::ptrdiff_t>(x));
        }
    }

    void gather_row(std::size_t y, RaySink& sink)
    {
        Rays& rays = m_rows.local();
        rays.met_around.assign(m_grid.width, Met::both);
        if (takes_a_look())
            look_around(y, rays.met_around);
        for (std::size_t x = 0; x < m_grid.width; x += texels_at_once) {
            const Span span{y, x, std::min(texels_at_once, m_grid.width - x)};
            const auto begin = rays.met_around.begin() + static_cast<std::ptrdiff_t>(x);
            const auto end = begin + static_cast<std::ptrdiff_t>(span.width);
            const std::size_t most = std::find(begin, end, Met::both) == end ? m_even_rays : m_rays;
            for (std::size_t first = 0; first < most; first += max_rays_at_once)
                gather_some(span, first, std::min(most - first, max_rays_at_once), rays, sink);
        }
    }

private:
    // Part of a row of texels.
    struct Span {
        std::size_t y;
        std::size_t x;
        std::size_t width;
    };

    // Of a span; the last six of one texel.
    struct Rays {
        Span span{};
        std::vector<Vec3f> travel, irradiance;  // [ray * width + texel]
        std::vector<std::uint8_t> met;  // [texel]
        std::vector<std::uint8_t> met_around;  // [texel of the row] by its own rays and those around it
        // A packet that is being filled, and what its rays carry.
        std::array<ShadowRay, Occluders::packet_size> packet;
        std::array<std::size_t, Occluders::packet_size> carried;
        std::size_t waiting = 0;
        std::vector<Vec2> on_light, in_texel, unsorted;
        std::vector<Vec3> points, weights;
        std::vector<LightRay> found;

        void start(std::size_t count, const Span& of)
        {
            span = of;
            travel.assign(count * span.width, Vec3f(0.0f, 0.0f, -1.0f));
            irradiance.assign(count * span.width, Vec3f(0.0f));
            met.assign(span.width, Met::nothing);
            resize(count);
        }

        void resize(std::size_t count)
        {
            on_light.resize(count);
            in_texel.resize(count);
            points.resize(count);
            weights.resize(count);
            found.resize(count);
        }

        // Brings together rays towards the same part of the light: a packet of such meets the same triangles.
        void sort()
        {
            constexpr std::size_t side = 8;
            constexpr std::array<std::uint8_t, side> spread = {0, 1, 4, 5, 16, 17, 20, 21};
            const auto part = [&](std::size_t i) {
                const auto x = static_cast<std::size_t>(on_light[i].x * side);
                const auto y = static_cast<std::size_t>(on_light[i].y * side);
                return static_cast<std::size_t>(spread[x] + 2 * spread[y]);  // along a Morton curve
            };
            if (on_light.size() < 2 * Occluders::packet_size)
                return;
            std::array<std::size_t, side * side + 1> end{};
            for (std::size_t i = 0; i < on_light.size(); ++i)
                ++end[part(i) + 1];
            for (std::size_t i = 1; i < end.size(); ++i)
                end[i] += end[i - 1];
            unsorted.resize(2 * on_light.size());
            for (std::size_t i = 0; i < on_light.size(); ++i) {
                const std::size_t to = end[part(i)]++;
                unsorted[2 * to] = on_light[i];
                unsorted[2 * to + 1] = in_texel[i];
            }
            for (std::size_t i = 0; i < on_light.size(); ++i) {
                on_light[i] = unsorted[2 * i];
                in_texel[i] = unsorted[2 * i + 1];
            }
        }
    };

    // Some of a texel's rays.
    struct Part {
        const GridSobol& sobol;
        std::size_t first;
        std::size_t count;
        std::size_t all;
        bool is_traced;
    };

    std::vector<std::uint8_t>::iterator met_in(std::size_t y)
    {
        return m_met.begin() + static_cast<std::ptrdiff_t>(y * m_grid.width);
    }

    // What was met by rays of the texels in a row and of their neighbours.
    void look_around(std::size_t y, std::vector<std::uint8_t>& around)
    {
        std::fill(around.begin(), around.end(), Met::nothing);
        for (std::size_t row = y - std::min<std::size_t>(y, 1); row < std::min(y + 2, m_grid.height); ++row) {
            const auto met = met_in(row);
            for (std::size_t x = 0; x < m_grid.width; ++x)
                for (std::size_t beside = x - std::min<std::size_t>(x, 1); beside < std::min(x + 2, m_grid.width);
                     ++beside)
                    around[x] |= met[static_cast<std::ptrdiff_t>(beside)];
        }
    }

    void gather_some(const Span& span, std::size_t first, std::size_t count, Rays& rays, RaySink& sink) const
    {
        rays.start(count, span);
        for (std::size_t i = 0; i < span.width; ++i) {
            const std::uint8_t around = rays.met_around[span.x + i];
            if (around == Met::both)
                gather_texel(i, {m_sobol, first, count, m_rays, m_occluders != nullptr}, rays);
            else if (around == Met::light && first < m_even_rays)
                gather_texel(i, {m_even_sobol, first, std::min(count, m_even_rays - first), m_even_rays, false}, rays);
        }
        trace(rays);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t begin = i * span.width;
            sink.add({.ray = first + i,
                      .y = span.y,
                      .x = span.x,
                      .width = span.width,
                      .travel = &rays.travel[begin],
                      .irradiance = &rays.irradiance[begin]});
        }
    }

    // Of a texel of the span.
    void gather_texel(std::size_t texel, const Part& part, Rays& rays) const
    {
        const std::size_t count = part.count;
        const std::size_t x = rays.span.x + texel;
        const std::size_t y = rays.span.y;
        const Vec3 open = m_open.at(x, y) * (static_cast<double>(count) / static_cast<double>(part.all));
        if (open == Vec3(0.0))
            return;
        rays.resize(count);
        part.sobol.points(x, y, part.first, count, rays.on_light.data(), rays.in_texel.data());
        if (part.is_traced)
            rays.sort();
        Vec3 sum = sample(x, y, rays);
        // Where all miss, although there is light, others are tried.
        for (int i = 0; i < max_trials && sum == Vec3(0.0); ++i) {
            for (std::size_t k = 0; k < count; ++k) {
                rays.on_light[k] = glm::fract(rays.on_light[k] + step_on_light);
                rays.in_texel[k] = glm::fract(rays.in_texel[k] + step_in_texel);
            }
            sum = sample(x, y, rays);
        }
        // The sum of what comes unhindered is known: what is hindered takes its part of it.
        // A channel in which all rays happen to be dark goes along with the mean of the channels.
        const auto lit = [is_dark = glm::equal(sum, Vec3(0.0))](const Vec3& weight) {
            return glm::mix(weight, Vec3((weight.x + weight.y + weight.z) / 3.0), is_dark);
        };
        const Vec3 scale = open / lit(sum);
        for (std::size_t i = 0; i < count; ++i) {
            if (rays.weights[i] == Vec3(0.0))
                continue;
            const LightRay& found = rays.found[i];
            const std::size_t index = i * rays.span.width + texel;
            rays.travel[index] = Vec3f(glm::normalize(m_grid.to_plane(found.travel)));
            rays.irradiance[index] = Vec3f(scale * lit(rays.weights[i]));
            if (!part.is_traced)
                continue;
            rays.packet[rays.waiting] = shadow_ray(m_grid, m_start, rays.points[i], found.travel, found.distance);
            rays.carried[rays.waiting] = index;
            if (++rays.waiting == Occluders::packet_size)
                trace(rays);
        }
    }

    // The rays of a texel at their places, and what they carry unhindered; returns the sum of that.
    Vec3 sample(std::size_t x, std::size_t y, Rays& rays) const
    {
        const std::size_t count = rays.on_light.size();
        for (std::size_t i = 0; i < count; ++i)
            rays.points[i] =
                m_grid.point(static_cast<double>(x) + rays.in_texel[i].x, static_cast<double>(y) + rays.in_texel[i].y);
        if (m_is_far)
            m_light.sample(rays.points.front(), m_grid.normal, rays.on_light, rays.found.data());
        else
            for (std::size_t i = 0; i < count; ++i)
                m_light.sample(rays.points[i], m_grid.normal, {&rays.on_light[i], 1}, &rays.found[i]);
        Vec3 sum(0.0);
        for (std::size_t i = 0; i < count; ++i) {
            const LightRay& found = rays.found[i];
            const double cos_theta = -glm::dot(found.travel, m_grid.normal);
            const bool counts = cos_theta > min_cos_theta && found.distance > m_position_rounding;
            rays.weights[i] = counts ? Vec3(found.flux) * cos_theta : Vec3(0.0);
            sum += rays.weights[i];
        }
        return sum;
    }

    void trace(Rays& rays) const
    {
        std::array<Vec3f, Occluders::packet_size> transmittance;
        if (rays.waiting > 0)
            // Those of a texel to a sky go all ways: traced as if they went the same, they take half as long again.
            m_occluders->transmit(std::span(rays.packet).first(rays.waiting), transmittance.data(), false);
        for (std::size_t i = 0; i < rays.waiting; ++i) {
            const std::size_t index = rays.carried[i];
            rays.irradiance[index] *= transmittance[i];
            std::uint8_t& met = rays.met[index % rays.span.width];
            met |= transmittance[i] == Vec3f(1.0f)   ? Met::light
                   : transmittance[i] == Vec3f(0.0f) ? Met::obstacle
                                                     : Met::both;
        }
        rays.waiting = 0;
    }

    const ReceiverGrid& m_grid;
    std::unique_ptr<const ExtendedLight> m_prepared;
    const ExtendedLight& m_light;
    OpenIrradiance m_open;
    bool m_is_far;
    const Occluders* m_occluders;
    std::size_t m_rays;
    std::size_t m_even_rays;
    GridSobol m_sobol;
    GridSobol m_even_sobol;
    RayStart m_start;
    double m_position_rounding;
    std::vector<std::uint8_t> m_met;  // [texel] by the rays of a look
    PerThread<Rays> m_rows;
};

}  // namespace

void gather_rays(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                 const RaySettings& settings, RaySink& sink, Progress& progress)
{
    grid.check();
    if (settings.rays < 1 || settings.rays > max_rays)
        reject("rays", settings.rays, "1 to " + std::to_string(max_rays));
    if (settings.even_rays < 0)
        reject("even_rays", settings.even_rays, "0 or more");
    detail::check_length("clearance", settings.clearance);

    const auto gather = [&] {
        RayGatherer gatherer(grid, light, occluders, settings);
        progress.set_total(static_cast<double>(grid.height) * (gatherer.takes_a_look() ? 2.0 : 1.0));
        if (gatherer.takes_a_look())
            parallel_for(grid.height, [&](std::size_t y) {
                gatherer.look_at_row(y);
                progress.advance(1.0);
            });
        parallel_for(grid.height, [&](std::size_t y) {
            gatherer.gather_row(y, sink);
            progress.advance(1.0);
        });
    };
    with_threads(settings.threads, gather);
    progress.finish();
}

}  // namespace beamspread
