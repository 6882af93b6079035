#include "scene/ray_gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/pool.h"
#include "base/sobol.h"
#include "base/threads.h"
#include "base/vec.h"
#include "scene/beams.h"
#include "scene/open_irradiance.h"
#include "scene/ray_start.h"

namespace beamspread {

namespace {

// More rays of a row than that are not kept at once: 50 MB of each thread for 8192 texels.
constexpr std::size_t max_rays_at_once = 256;

// What the rays of a texel met.
enum Met : std::uint8_t { nothing = 0, light = 1, obstacle = 2, both = light | obstacle };

// How often rays are moved on where none finds the light: with half as many, 6 of 416 texels that a narrow lamp just
// reaches stay dark, 1e-5 of its light, with twice as many none as with these. And how far: a lattice of four dimensions (Roberts 2018, "The
// unreasonable effectiveness of quasirandom sequences").
constexpr int max_trials = 64;
constexpr GridSobol::Point steps = {0.8566748838545029, 0.7338918566271259, 0.6287067210378086, 0.5385972572236101};

// One light's rays on one grid.
class RayGatherer {
public:
    RayGatherer(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                const RaySettings& settings)
        : m_grid(grid),
          m_prepared(light.facing(grid.normal)),
          m_light(m_prepared ? *m_prepared : light),
          m_open(grid, m_light),
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
        const auto lease = m_rows.lend();
        Rays& rays = *lease;
        rays.start(m_even_rays, m_grid.width);
        for (std::size_t x = 0; x < m_grid.width; ++x)
            gather_texel(x, y, {m_even_sobol, 0, m_even_rays, m_even_rays, true}, rays);
        trace(rays);
        std::copy(rays.met.begin(), rays.met.end(), met_in(y));
    }

    void gather_row(std::size_t y, RaySink& sink)
    {
        const auto lease = m_rows.lend();
        Rays& rays = *lease;
        rays.met_around.assign(m_grid.width, Met::both);
        if (takes_a_look())
            look_around(y, rays.met_around);
        const bool is_even =
            std::find(rays.met_around.begin(), rays.met_around.end(), Met::both) == rays.met_around.end();
        const std::size_t most = is_even ? m_even_rays : m_rays;
        for (std::size_t first = 0; first < most; first += max_rays_at_once)
            gather_some(y, first, std::min(most - first, max_rays_at_once), rays, sink);
    }

private:
    // Of one row; the last four of one texel.
    struct Rays {
        std::vector<Vec3f> travel, irradiance;  // [ray * width + texel]
        std::vector<std::uint8_t> met, met_around;  // [texel] by its own rays, and by those around it
        // A packet that is being filled, and what its rays carry.
        std::array<ShadowRay, Occluders::packet_size> packet;
        std::array<std::size_t, Occluders::packet_size> carried;
        std::size_t waiting = 0;
        std::vector<GridSobol::Point> places;
        std::vector<Vec3> points, weights;
        std::vector<LightRay> found;

        void start(std::size_t count, std::size_t width)
        {
            travel.assign(count * width, Vec3f(0.0f, 0.0f, -1.0f));
            irradiance.assign(count * width, Vec3f(0.0f));
            met.assign(width, Met::nothing);
            places.resize(count);
            points.resize(count);
            weights.resize(count);
            found.resize(count);
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

    void gather_some(std::size_t y, std::size_t first, std::size_t count, Rays& rays, RaySink& sink) const
    {
        rays.start(count, m_grid.width);
        for (std::size_t x = 0; x < m_grid.width; ++x) {
            const std::uint8_t around = rays.met_around[x];
            if (around == Met::both)
                gather_texel(x, y, {m_sobol, first, count, m_rays, m_occluders != nullptr}, rays);
            else if (around == Met::light && first < m_even_rays)
                gather_texel(x, y, {m_even_sobol, first, std::min(count, m_even_rays - first), m_even_rays, false},
                             rays);
        }
        trace(rays);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t begin = i * m_grid.width;
            sink.add(
                {.y = y, .width = m_grid.width, .travel = &rays.travel[begin], .irradiance = &rays.irradiance[begin]});
        }
    }

    void gather_texel(std::size_t x, std::size_t y, const Part& part, Rays& rays) const
    {
        const std::size_t count = part.count;
        const Vec3 open = m_open.at(x, y) * (static_cast<double>(count) / static_cast<double>(part.all));
        if (open == Vec3(0.0))
            return;
        rays.places.resize(count);
        part.sobol.points(x, y, part.first, count, rays.places.data());
        Vec3 sum = sample(x, y, rays);
        // Where all miss, although there is light, others are tried.
        for (int i = 0; i < max_trials && sum == Vec3(0.0); ++i) {
            for (GridSobol::Point& place : rays.places) {
                for (std::size_t k = 0; k < place.size(); ++k)
                    place[k] += steps[k] - std::floor(place[k] + steps[k]);
            }
            sum = sample(x, y, rays);
        }
        // The sum of what comes unhindered is known: what is hindered takes its part of it.
        // A channel in which all rays happen to be dark goes along with the mean of the channels.
        const double mean = (sum.x + sum.y + sum.z) / 3.0;
        const Vec3 scale = open / glm::mix(sum, Vec3(mean), glm::equal(sum, Vec3(0.0)));
        const auto unhindered = [&](const Vec3& weight) {
            return scale * glm::mix(weight, Vec3((weight.x + weight.y + weight.z) / 3.0), glm::equal(sum, Vec3(0.0)));
        };
        for (std::size_t i = 0; i < count; ++i) {
            if (rays.weights[i] == Vec3(0.0))
                continue;
            const LightRay& found = rays.found[i];
            const std::size_t index = i * m_grid.width + x;
            rays.travel[index] = Vec3f(glm::normalize(m_grid.to_plane(found.travel)));
            rays.irradiance[index] = Vec3f(unhindered(rays.weights[i]));
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
        Vec3 sum(0.0);
        for (std::size_t i = 0; i < rays.places.size(); ++i) {
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
            std::uint8_t& met = rays.met[index % m_grid.width];
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
    const Occluders* m_occluders;
    std::size_t m_rays;
    std::size_t m_even_rays;
    GridSobol m_sobol;
    GridSobol m_even_sobol;
    RayStart m_start;
    double m_position_rounding;
    std::vector<std::uint8_t> m_met;  // [texel] by the rays of a look
    Pool<Rays> m_rows;
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
    if (!(settings.clearance >= 0.0) || std::isinf(settings.clearance))
        reject("clearance", settings.clearance, "a finite length >= 0 in metres");

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
