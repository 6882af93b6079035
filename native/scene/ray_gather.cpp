#include "scene/ray_gather.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/sobol.h"
#include "base/threads.h"
#include "scene/checks.h"
#include "scene/open_irradiance.h"
#include "scene/shadow_ray.h"

namespace beamspread {

namespace {

// Texels of a row, and rays of each, that are gathered at once. More need more of the processor's cache: 400 kB here.
constexpr std::size_t texels_at_once = 64;
constexpr std::size_t max_rays_at_once = 256;

// Number of times that the rays of a texel are moved on if none finds the light. More find narrower lights.
constexpr int max_trials = 64;

// Steps by which they are moved on: a lattice of four dimensions (Roberts 2018, "The unreasonable effectiveness of
// quasirandom sequences").
constexpr Vec2 step_on_light(0.8566748838545029, 0.7338918566271259);
constexpr Vec2 step_in_texel(0.6287067210378086, 0.5385972572236101);

// Obstacles and light that the rays of a texel met.
enum Met : std::uint8_t { nothing = 0, light = 1, obstacle = 2, both = light | obstacle };

// Rays of one light with a size, from the texels of one grid.
class SizedGatherer {
public:
    SizedGatherer(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const RaySettings& settings)
        : m_grid(grid),
          m_prepared(light.facing(grid.normal)),
          m_light(m_prepared ? *m_prepared : light),
          m_open(grid, m_light),
          m_occluders(occluders),
          m_with_travel(settings.with_travel),
          m_ray_count(static_cast<std::size_t>(settings.rays)),
          m_even_rays(occluders ? std::min(static_cast<std::size_t>(settings.even_rays), m_ray_count) : 0),
          m_sobol(m_ray_count, settings.seed),
          m_even_sobol(std::max<std::size_t>(m_even_rays, 1), settings.seed),
          m_rays(grid, occluders, settings.clearance)
    {
        if (has_first_pass())
            m_met.resize(grid.width * grid.height);
    }

    bool has_first_pass() const { return m_even_rays > 0 && m_even_rays < m_ray_count; }

    // Traces few rays from a row, to find where it and its neighbors need more.
    void trace_first(std::size_t y)
    {
        Work& work = m_work.local();
        for (std::size_t x = 0; x < m_grid.width; x += texels_at_once) {
            const Span span{y, x, std::min(texels_at_once, m_grid.width - x)};
            work.start(m_even_rays, span);
            for (std::size_t i = 0; i < span.width; ++i)
                gather_texel(i, {m_even_sobol, 0, m_even_rays, m_even_rays, true}, work);
            trace(work);
            std::copy(work.met.begin(), work.met.end(), met_in(y) + static_cast<std::ptrdiff_t>(x));
        }
    }

    void gather_row(std::size_t y, RaySink& sink)
    {
        Work& work = m_work.local();
        work.met_around.assign(m_grid.width, Met::both);
        if (has_first_pass())
            find_met_around(y, work.met_around);
        for (std::size_t x = 0; x < m_grid.width; x += texels_at_once) {
            const Span span{y, x, std::min(texels_at_once, m_grid.width - x)};
            const auto begin = work.met_around.begin() + static_cast<std::ptrdiff_t>(x);
            const auto end = begin + static_cast<std::ptrdiff_t>(span.width);
            const std::size_t ray_count = std::find(begin, end, Met::both) == end ? m_even_rays : m_ray_count;
            for (std::size_t first = 0; first < ray_count; first += max_rays_at_once)
                gather_span(span, first, std::min(ray_count - first, max_rays_at_once), work, sink);
        }
    }

private:
    // Part of a row of texels.
    struct Span {
        std::size_t y;
        std::size_t x;
        std::size_t width;
    };

    // Working memory of a thread: first the rays of a span, then those of one texel.
    struct Work {
        Span span{};
        std::vector<Vec3f> travel, irradiance;  // [ray * width + texel]
        std::vector<std::uint8_t> met;          // [texel]
        std::vector<std::uint8_t> met_around;   // [texel of the row] by its rays and those of its neighbors
        // A packet of rays that is being filled, and the index of each in `irradiance`.
        std::array<ShadowRay, Occluders::packet_size> packet;
        std::array<std::size_t, Occluders::packet_size> carried;
        std::size_t waiting = 0;
        std::vector<Vec2> on_light, in_texel;
        std::vector<Vec3> points, weights;
        std::vector<LightRay> rays;

        void start(std::size_t count, const Span& new_span)
        {
            span = new_span;
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
            rays.resize(count);
        }
    };

    // Rays [first, first + count) of the `all` rays of a texel.
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

    // Finds for each texel of a row the obstacles and light that the first pass met in it and its neighbors.
    void find_met_around(std::size_t y, std::vector<std::uint8_t>& around)
    {
        std::fill(around.begin(), around.end(), Met::nothing);
        for (std::size_t row = y > 0 ? y - 1 : 0; row <= std::min(y + 1, m_grid.height - 1); ++row) {
            const auto met = met_in(row);
            for (std::size_t x = 0; x < m_grid.width; ++x)
                for (std::size_t beside = x > 0 ? x - 1 : 0; beside <= std::min(x + 1, m_grid.width - 1); ++beside)
                    around[x] |= met[static_cast<std::ptrdiff_t>(beside)];
        }
    }

    void gather_span(const Span& span, std::size_t first, std::size_t count, Work& work, RaySink& sink) const
    {
        work.start(count, span);
        for (std::size_t i = 0; i < span.width; ++i) {
            const std::uint8_t around = work.met_around[span.x + i];
            if (around == Met::both)
                gather_texel(i, {m_sobol, first, count, m_ray_count, m_occluders != nullptr}, work);
            else if (around == Met::light && first < m_even_rays)
                gather_texel(i, {m_even_sobol, first, std::min(count, m_even_rays - first), m_even_rays, false}, work);
        }
        trace(work);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t begin = i * span.width;
            sink.add({.sample = span.y * m_grid.width + span.x,
                      .count = span.width,
                      .ray = first + i,
                      .travel = m_with_travel ? &work.travel[begin] : nullptr,
                      .irradiance = &work.irradiance[begin]});
        }
    }

    void gather_texel(std::size_t texel, const Part& part, Work& work) const
    {
        const std::size_t count = part.count;
        const std::size_t x = work.span.x + texel;
        const std::size_t y = work.span.y;
        // The share of the texel's open irradiance that this part of its rays carries.
        const Vec3 open = m_open.at(x, y) * (static_cast<double>(count) / static_cast<double>(part.all));
        if (open == Vec3(0.0))
            return;
        work.resize(count);
        part.sobol.points(x, y, part.first, count, work.on_light.data(), work.in_texel.data());
        Vec3 sum = sample(x, y, work);
        for (int i = 0; i < max_trials && sum == Vec3(0.0); ++i) {
            for (std::size_t k = 0; k < count; ++k) {
                work.on_light[k] = glm::fract(work.on_light[k] + step_on_light);
                work.in_texel[k] = glm::fract(work.in_texel[k] + step_in_texel);
            }
            sum = sample(x, y, work);
        }
        // Open rays are scaled to the open irradiance, which is known; blocked rays then take their part of it. A channel
        // in which all rays happen to be dark follows the mean of the channels.
        const auto lit = [is_dark = glm::equal(sum, Vec3(0.0))](const Vec3& weight) {
            return glm::mix(weight, Vec3((weight.x + weight.y + weight.z) / 3.0), is_dark);
        };
        const Vec3 scale = open / lit(sum);
        for (std::size_t i = 0; i < count; ++i) {
            if (work.weights[i] == Vec3(0.0))
                continue;
            const LightRay& ray = work.rays[i];
            const std::size_t index = i * work.span.width + texel;
            if (m_with_travel)
                work.travel[index] = Vec3f(glm::normalize(m_grid.to_plane(ray.travel)));
            work.irradiance[index] = Vec3f(scale * lit(work.weights[i]));
            if (!part.is_traced)
                continue;
            work.packet[work.waiting] = m_rays.shadow_ray(work.points[i], ray);
            work.carried[work.waiting] = index;
            if (++work.waiting == Occluders::packet_size)
                trace(work);
        }
    }

    // Finds the rays of a texel at their places and the irradiance that each brings unblocked; returns the sum.
    Vec3 sample(std::size_t x, std::size_t y, Work& work) const
    {
        for (std::size_t i = 0; i < work.points.size(); ++i)
            work.points[i] =
                m_grid.point(static_cast<double>(x) + work.in_texel[i].x, static_cast<double>(y) + work.in_texel[i].y);
        m_light.sample(work.points, m_grid.normal, work.on_light, work.rays.data());
        Vec3 sum(0.0);
        for (std::size_t i = 0; i < work.points.size(); ++i) {
            work.weights[i] = Vec3(work.rays[i].flux) * m_rays.arriving_cosine(work.rays[i]);
            sum += work.weights[i];
        }
        return sum;
    }

    void trace(Work& work) const
    {
        std::array<Vec3f, Occluders::packet_size> transmittance;
        if (work.waiting > 0)
            // Rays of a texel to the sky diverge: tracing them as coherent takes half as long again.
            m_occluders->transmit(std::span(work.packet).first(work.waiting), transmittance.data(), false);
        for (std::size_t i = 0; i < work.waiting; ++i) {
            const std::size_t index = work.carried[i];
            work.irradiance[index] *= transmittance[i];
            work.met[index % work.span.width] |= transmittance[i] == Vec3f(1.0f)   ? Met::light
                                                 : transmittance[i] == Vec3f(0.0f) ? Met::obstacle
                                                                                   : Met::both;
        }
        work.waiting = 0;
    }

    const ReceiverGrid& m_grid;
    std::unique_ptr<const Light> m_prepared;
    const Light& m_light;
    OpenIrradiance m_open;
    const Occluders* m_occluders;
    bool m_with_travel;
    std::size_t m_ray_count;
    std::size_t m_even_rays;
    GridSobol m_sobol;
    GridSobol m_even_sobol;
    ReceiverRays m_rays;
    std::vector<std::uint8_t> m_met;  // [texel] in the first pass
    PerThread<Work> m_work;
};

void gather_sized_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                       const RaySettings& settings, RaySink& sink, Progress& progress)
{
    SizedGatherer gatherer(grid, light, occluders, settings);
    progress.set_total(static_cast<double>(grid.height) * (gatherer.has_first_pass() ? 2.0 : 1.0));
    if (gatherer.has_first_pass())
        parallel_for(grid.height, [&](std::size_t y) {
            gatherer.trace_first(y);
            progress.advance(1.0);
        });
    parallel_for(grid.height, [&](std::size_t y) {
        gatherer.gather_row(y, sink);
        progress.advance(1.0);
    });
}

}  // namespace

void gather_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const RaySettings& settings,
                 RaySink& sink, Progress& progress)
{
    grid.check();
    if (settings.samples < 1 || settings.samples > max_samples)
        reject("samples", settings.samples, "1 to " + std::to_string(max_samples));
    if (settings.rays < 1 || settings.rays > max_rays)
        reject("rays", settings.rays, "1 to " + std::to_string(max_rays));
    if (settings.even_rays < 0)
        reject("even_rays", settings.even_rays, "0 or more");
    detail::check_length("clearance", settings.clearance);
    with_threads(settings.threads, [&] {
        const auto gather = light.is_delta() ? detail::gather_delta_rays : gather_sized_rays;
        gather(grid, light, occluders, settings, sink, progress);
    });
    progress.finish();
}

}  // namespace beamspread
