#include "scene/ray_gather.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/sobol.h"
#include "base/threads.h"
#include "scene/checks.h"
#include "scene/first_pass.h"
#include "scene/open_irradiance.h"
#include "scene/open_tiles.h"
#include "scene/ray_order.h"
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

// Rays of one light with a size, from the texels of one grid.
class SizedGatherer {
public:
    SizedGatherer(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const RaySettings& settings)
        : m_grid(grid),
          m_prepared(grid.is_bent() ? light.facing_all() : light.facing(grid.normal, grid.points())),
          m_light(m_prepared ? *m_prepared : light),
          m_open(grid, m_light, settings.at_centers),
          m_occluders(occluders),
          m_with_travel(settings.with_travel),
          m_is_coherent(!m_light.corners().empty()),
          m_ray_count(std::bit_floor(static_cast<std::size_t>(settings.rays))),
          m_even_rays(std::bit_floor(std::min(static_cast<std::size_t>(settings.even_rays), m_ray_count))),
          m_sobol(m_ray_count, settings.seed),
          m_even_sobol(std::max<std::size_t>(m_even_rays, 1), settings.seed),
          m_rays(grid, occluders, settings.clearance)
    {
        if (occluders && m_even_rays > 0 && m_even_rays < m_ray_count)
            m_first_pass.emplace(grid.width, grid.height, m_even_rays, m_ray_count, settings.seed);
        if (occluders && settings.find_shadows)
            m_open_tiles.emplace(grid, m_light, *occluders, m_rays.start(), FirstPass::tile_side);
        if (settings.noise)
            m_noise.resize(grid.height);
    }

    bool has_first_pass() const { return m_first_pass.has_value(); }

    // Traces few rays from all texels, to find where they and their neighbors need more.
    void trace_first(Progress& progress)
    {
        if (!m_first_pass)
            return;
        constexpr std::size_t rows = FirstPass::tile_side;
        parallel_for((m_grid.height + rows - 1) / rows, [&](std::size_t i) {
            const std::size_t end = std::min((i + 1) * rows, m_grid.height);
            for (std::size_t y = i * rows; y < end; ++y)
                trace_first(y, *m_first_pass);
            progress.advance(static_cast<double>(end - i * rows));
        });
        m_first_pass->search([this](std::span<const Vec2> positions, std::span<const Vec2> places,
                                    std::uint8_t* arrives) { probe(positions, places, arrives); },
                             progress);
    }

    void gather_row(std::size_t y, RaySink& sink)
    {
        Work& work = m_work.local();
        if (m_first_pass)
            work.row.find(*m_first_pass, y);
        for (std::size_t x = 0; x < m_grid.width; x += texels_at_once) {
            const Span span{y, x, std::min(texels_at_once, m_grid.width - x)};
            std::size_t most = 0;
            for (std::size_t i = 0; i < span.width; ++i)
                most = std::max(most, rays_of(work, x + i));
            work.halves.assign(m_noise.empty() ? 0 : 2 * span.width, 0.0);
            for (std::size_t first = 0; first < most; first += max_rays_at_once)
                gather_span(span, first, std::min(most - first, max_rays_at_once), work, sink);
            if (!m_noise.empty())
                m_noise[y].add(noise_of(span, work), 1.0);
        }
    }

    // Noise of all texels.
    RayNoise noise() const
    {
        RayNoise sum;
        for (const RayNoise& row : m_noise)
            sum.add(row, 1.0);
        const auto texels = static_cast<double>(std::max<std::size_t>(m_grid.receiving(), 1));
        return {sum.irradiance / texels, sum.variance / texels};
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
        std::vector<double> halves;             // [half * width + texel] light of either half of its rays
        // Of the first pass alone.
        std::vector<LightHit> hits;        // [ray * width + texel], also of rays that are blocked
        std::vector<std::uint8_t> met;     // [texel]
        std::vector<FirstRays> first;      // [texel]
        std::vector<LightHit> arrived;     // rays of some texels that get through
        FirstPass::Row row;
        // A packet of rays that is being filled, and the index of each in `irradiance`.
        std::array<ShadowRay, Occluders::packet_size> packet;
        std::array<std::size_t, Occluders::packet_size> carried;
        std::size_t waiting = 0;
        bool is_first = false;
        std::vector<Vec2> on_light, in_texel;
        std::vector<double> densities;
        std::vector<Vec3> points, weights;
        std::vector<LightRay> rays;
        RayOrder order;  // in which rays are traced

        void start(std::size_t count, const Span& new_span)
        {
            span = new_span;
            travel.assign(count * span.width, Vec3f(0.0f, 0.0f, -1.0f));
            irradiance.assign(count * span.width, Vec3f(0.0f));
            is_first = false;
            resize(count);
        }

        void resize(std::size_t count)
        {
            on_light.resize(count);
            in_texel.resize(count);
            densities.resize(count);
            points.resize(count);
            weights.resize(count);
            rays.resize(count);
        }
    };

    // Rays [first, first + count) of the `all` rays of a texel.
    struct Part {
        const GridSobol* sobol;
        std::size_t first;
        std::size_t count;
        std::size_t all;
        bool is_traced;
        const LightGuide* guide = nullptr;
        // True if the rays of the texel are scaled to the open irradiance, which is known. It takes the noise of rays that
        // nothing blocks, and is wrong for few rays.
        bool is_scaled = true;
    };

    RayMethod method(const Work& work, std::size_t x) const
    {
        return has_first_pass() ? work.row.method(x) : is_open() ? RayMethod::open : RayMethod::even;
    }

    std::size_t rays_of(const Work& work, std::size_t x) const
    {
        return has_first_pass() ? work.row.rays(x) : is_open() ? m_even_rays : m_ray_count;
    }

    // True if nothing blocks rays of this texel, nor of those around.
    bool is_in_open_tile(std::size_t x, std::size_t y) const { return m_open_tiles && m_open_tiles->is_open(x, y); }

    // True if nothing blocks rays of any texel.
    bool is_open() const { return !m_occluders && m_even_rays > 0; }

    // Traces few rays from a row, and notes them.
    void trace_first(std::size_t y, FirstPass& pass)
    {
        Work& work = m_work.local();
        for (std::size_t x = 0; x < m_grid.width; x += texels_at_once) {
            const Span span{y, x, std::min(texels_at_once, m_grid.width - x)};
            work.start(m_even_rays, span);
            work.is_first = true;
            work.hits.resize(m_even_rays * span.width);
            work.met.assign(span.width, Met::nothing);
            work.first.assign(span.width, {});
            for (std::size_t i = 0; i < span.width; ++i)
                if (is_in_open_tile(span.x + i, y))
                    note_open(i, work);
                else
                    gather_texel(i, {&m_even_sobol, 0, m_even_rays, m_even_rays, true}, work);
            trace(work);
            for (std::size_t i = 0; i < span.width; i += FirstPass::tile_side)
                note(i, std::min(FirstPass::tile_side, span.width - i), work, pass);
        }
    }

    // Notes a texel of a span whose rays nothing can block.
    void note_open(std::size_t texel, Work& work)
    {
        const float open = mean(Vec3f(m_open.at(work.span.x + texel, work.span.y)));
        work.met[texel] = open > 0.0f ? Met::light : Met::nothing;
        work.first[texel] = {.open = open, .irradiance = open};
    }

    // Notes the first rays of texels [first, first + count) of a span, which lie in one tile.
    void note(std::size_t first, std::size_t count, Work& work, FirstPass& pass) const
    {
        work.arrived.clear();
        for (std::size_t i = 0; i < m_even_rays; ++i)
            for (std::size_t k = first; k < first + count; ++k) {
                const std::size_t index = i * work.span.width + k;
                if (work.irradiance[index] != Vec3f(0.0f))
                    work.arrived.push_back(work.hits[index]);
            }
        pass.note(work.span.x + first, work.span.y, std::span(work.met).subspan(first, count),
                  std::span(work.first).subspan(first, count), work.arrived);
    }

    // Mean of the channels.
    static float mean(const Vec3f& light) { return (light.x + light.y + light.z) / 3.0f; }

    // Sums of the noise of a span.
    RayNoise noise_of(const Span& span, const Work& work) const
    {
        RayNoise noise;
        for (std::size_t i = 0; i < span.width; ++i) {
            const RayMethod method_here = method(work, span.x + i);
            if (method_here <= RayMethod::open) {
                const Vec3& open = m_open.at(span.x + i, span.y);
                noise.irradiance += method_here == RayMethod::open ? (open.x + open.y + open.z) / 3.0 : 0.0;
                continue;
            }
            const double first = work.halves[i];
            const double second = work.halves[span.width + i];
            noise.irradiance += first + second;
            // The variance of the sum, if the halves are independent; that of low-discrepancy rays is less.
            noise.variance += (first - second) * (first - second);
        }
        return noise;
    }

    void gather_span(const Span& span, std::size_t first, std::size_t count, Work& work, RaySink& sink)
    {
        work.start(count, span);
        for (std::size_t i = 0; i < span.width; ++i) {
            const RayMethod method_here = method(work, span.x + i);
            const std::size_t all = rays_of(work, span.x + i);
            if (first >= all)
                continue;
            Part part{&m_sobol, first, std::min(count, all - first), all,
                      m_occluders != nullptr && !is_in_open_tile(span.x + i, span.y)};
            if (method_here == RayMethod::open)
                part = {&m_even_sobol, first, part.count, all, false};
            else if (method_here == RayMethod::guided)
                part.guide = &work.row.guide(span.x + i);
            part.is_scaled = method_here == RayMethod::even || method_here == RayMethod::open;
            gather_texel(i, part, work);
        }
        trace(work);
        if (!m_noise.empty())
            add_halves(first, count, work);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t begin = i * span.width;
            sink.add({.sample = span.y * m_grid.width + span.x,
                      .count = span.width,
                      .ray = first + i,
                      .travel = m_with_travel ? &work.travel[begin] : nullptr,
                      .irradiance = &work.irradiance[begin]});
        }
    }

    // Adds rays [first, first + count) of a span to its halves, unless all texels are open.
    void add_halves(std::size_t first, std::size_t count, Work& work) const
    {
        const std::size_t width = work.span.width;
        bool is_open = true;
        for (std::size_t k = 0; k < width && is_open; ++k)
            is_open = method(work, work.span.x + k) <= RayMethod::open;
        for (std::size_t i = 0; i < count && !is_open; ++i)
            for (std::size_t k = 0; k < width; ++k) {
                const std::size_t half = 2 * (first + i) < rays_of(work, work.span.x + k) ? 0 : 1;
                work.halves[half * width + k] += static_cast<double>(mean(work.irradiance[i * width + k]));
            }
    }

    void gather_texel(std::size_t texel, const Part& part, Work& work)
    {
        const std::size_t count = part.count;
        const std::size_t x = work.span.x + texel;
        const std::size_t y = work.span.y;
        const std::size_t of_grid = y * m_grid.width + x;
        // The share of the texel's open irradiance that this part of its rays carries.
        const Vec3 open = m_open.at(x, y) * (static_cast<double>(count) / static_cast<double>(part.all));
        if (open == Vec3(0.0))
            return;
        work.resize(count);
        part.sobol->points(x, y, part.first, count, work.on_light.data(), work.in_texel.data());
        if (part.guide)
            for (std::size_t i = 0; i < count; ++i)
                work.densities[i] = part.guide->guide(
                    Vec2(static_cast<double>(x), static_cast<double>(y)) + work.in_texel[i], work.on_light[i]);
        Vec3 sum = sample(x, y, work);
        for (int i = 0; i < max_trials && sum == Vec3(0.0) && part.is_scaled; ++i) {
            for (std::size_t k = 0; k < count; ++k) {
                work.on_light[k] = glm::fract(work.on_light[k] + step_on_light);
                work.in_texel[k] = glm::fract(work.in_texel[k] + step_in_texel);
            }
            sum = sample(x, y, work);
        }
        // Open rays are scaled to the open irradiance, which is known; blocked rays then take their part of it. A channel
        // in which all rays happen to be dark follows the mean of the channels.
        const glm::bvec3 is_dark(part.is_scaled && sum.x == 0.0, part.is_scaled && sum.y == 0.0,
                                 part.is_scaled && sum.z == 0.0);
        const auto lit = [is_dark](const Vec3& weight) {
            return glm::mix(weight, Vec3((weight.x + weight.y + weight.z) / 3.0), is_dark);
        };
        const Vec3 scale = part.is_scaled ? open / lit(sum) : Vec3(1.0 / static_cast<double>(part.all));
        if (part.guide)
            for (std::size_t i = 0; i < count; ++i)
                work.weights[i] /= work.densities[i];
        if (part.is_traced)
            work.order.sort(work.on_light);
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t i = part.is_traced ? work.order[k] : k;
            if (work.weights[i] == Vec3(0.0))
                continue;
            const LightRay& ray = work.rays[i];
            const std::size_t index = i * work.span.width + texel;
            if (m_rays.is_behind_face(of_grid, ray)) {
                if (work.is_first)
                    note_first(texel, Met::obstacle, Vec3f(scale * lit(work.weights[i])), Vec3f(0.0f), work);
                continue;
            }
            if (m_with_travel)
                work.travel[index] = Vec3f(glm::normalize(m_grid.to_tangent(of_grid, ray.travel)));
            work.irradiance[index] = Vec3f(scale * lit(work.weights[i]));
            if (!part.is_traced)
                continue;
            if (work.is_first)
                work.hits[index] = {Vec2f(work.on_light[i]),
                                    Vec2f(Vec2(static_cast<double>(x), static_cast<double>(y)) + work.in_texel[i])};
            work.packet[work.waiting] = m_rays.shadow_ray(of_grid, work.points[i], ray);
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
        const std::size_t texel = y * m_grid.width + x;
        m_light.sample(work.points, m_grid.normal_at(texel), work.on_light, work.rays.data());
        Vec3 sum(0.0);
        for (std::size_t i = 0; i < work.points.size(); ++i) {
            work.weights[i] = Vec3(work.rays[i].flux) * m_rays.arriving_cosine(texel, work.rays[i]);
            sum += work.weights[i];
        }
        return sum;
    }

    void probe(std::span<const Vec2> positions, std::span<const Vec2> places, std::uint8_t* arrives) const
    {
        std::array<Vec3, Occluders::packet_size> points;
        std::array<std::size_t, Occluders::packet_size> texels;
        std::array<LightRay, Occluders::packet_size> rays;
        std::array<ShadowRay, Occluders::packet_size> shadow_rays;
        std::array<Vec3f, Occluders::packet_size> transmittance;
        for (std::size_t first = 0; first < positions.size(); first += Occluders::packet_size) {
            const std::size_t count = std::min(positions.size() - first, Occluders::packet_size);
            for (std::size_t i = 0; i < count; ++i) {
                points[i] = m_grid.point(positions[first + i].x, positions[first + i].y);
                texels[i] = m_grid.texel_at(positions[first + i].x, positions[first + i].y);
            }
            // The texels of a plane share a normal.
            const std::size_t at_once = m_grid.is_bent() ? 1 : count;
            for (std::size_t i = 0; i < count; i += at_once)
                m_light.sample(std::span(points).subspan(i, at_once), m_grid.normal_at(texels[i]),
                               places.subspan(first + i, at_once), &rays[i]);
            for (std::size_t i = 0; i < count; ++i)
                shadow_rays[i] = m_rays.shadow_ray(texels[i], points[i], rays[i]);
            m_occluders->transmit(std::span(shadow_rays).first(count), transmittance.data(), false);
            for (std::size_t i = 0; i < count; ++i)
                arrives[first + i] = rays[i].flux != Vec3f(0.0f) && transmittance[i] != Vec3f(0.0f) &&
                                     m_rays.arriving_cosine(texels[i], rays[i]) > 0.0 &&
                                     !m_rays.is_behind_face(texels[i], rays[i]);
        }
    }

    void trace(Work& work)
    {
        std::array<Vec3f, Occluders::packet_size> transmittance;
        if (work.waiting > 0)
            m_occluders->transmit(std::span(work.packet).first(work.waiting), transmittance.data(), m_is_coherent);
        for (std::size_t i = 0; i < work.waiting; ++i) {
            const std::size_t index = work.carried[i];
            const Vec3f open = work.irradiance[index];
            work.irradiance[index] *= transmittance[i];
            if (!work.is_first)
                continue;
            note_first(index % work.span.width,
                       transmittance[i] == Vec3f(1.0f)   ? Met::light
                       : transmittance[i] == Vec3f(0.0f) ? Met::obstacle
                                                         : Met::both,
                       open, work.irradiance[index], work);
        }
        work.waiting = 0;
    }

    // Notes a ray of the first pass from a texel of a span.
    static void note_first(std::size_t texel, Met met, const Vec3f& open, const Vec3f& irradiance, Work& work)
    {
        work.met[texel] |= met;
        FirstRays& rays = work.first[texel];
        ++rays.traced;
        rays.open += mean(open);
        rays.irradiance += mean(irradiance);
    }

    const ReceiverGrid& m_grid;
    std::shared_ptr<const Light> m_prepared;
    const Light& m_light;
    OpenIrradiance m_open;
    const Occluders* m_occluders;
    bool m_with_travel;
    // False for rays of a texel to the sky, which diverge: tracing them as coherent takes half as long again.
    bool m_is_coherent;
    std::size_t m_ray_count;
    std::size_t m_even_rays;
    GridSobol m_sobol;
    GridSobol m_even_sobol;
    ReceiverRays m_rays;
    std::optional<FirstPass> m_first_pass;
    std::optional<OpenTiles> m_open_tiles;
    std::vector<RayNoise> m_noise;  // [row] sums over its texels; empty unless noise is asked for
    PerThread<Work> m_work;
};

void gather_sized_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                       const RaySettings& settings, RaySink& sink, Progress& progress)
{
    SizedGatherer gatherer(grid, light, occluders, settings);
    progress.set_total(static_cast<double>(grid.height) * (gatherer.has_first_pass() ? 2.0 : 1.0));
    if (gatherer.has_first_pass())
        gatherer.trace_first(progress);
    parallel_for(grid.height, [&](std::size_t y) {
        gatherer.gather_row(y, sink);
        progress.advance(1.0);
    });
    if (settings.noise)
        settings.noise->add(gatherer.noise(), 1.0);
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
