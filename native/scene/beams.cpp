#include "scene/beams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "base/threads.h"
#include "scene/open_tiles.h"

namespace beamspread {

namespace {

// Few enough for a prompt cancel, enough to hide the cost of scheduling.
constexpr std::size_t rows_per_block = 4;

// Rounding of a vertex, of a texel's position and of the ray's origin moves each by up to half a unit in the last place
// of the largest coordinate; Embree's robust test adds a few. Starting this many units off the plane keeps a ray clear
// of the receiver's own triangles, and is far below what can be seen: 2 micrometres in a scene of 1 metre.
constexpr double offset_ulps = 16.0;

RayStart ray_start(const ReceiverGrid& grid, const Occluders* occluders, double clearance)
{
    const double reach = std::max(grid.reach(), occluders ? occluders->reach() : 0.0);
    return {.rounding = offset_ulps * static_cast<double>(std::numeric_limits<float>::epsilon()) * reach,
            .clearance = clearance};
}

// Sub-texel points in texels, n x n: one in each cell of an n x n grid and one in each of n^2 columns and n^2 rows, so
// that a shadow's border along the texels is resolved as finely as an oblique one (Chiu, Shirley, Wang 1994,
// "Multi-jittered sampling", without the jitter).
std::vector<Vec2> sub_texel_points(int samples)
{
    std::vector<Vec2> points;
    for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i)
            points.emplace_back((i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples);
    }
    return points;
}

// One light's beams on one grid.
template <class AnyLight>
class Gatherer {
public:
    Gatherer(const ReceiverGrid& grid, const AnyLight& light, const Occluders* occluders, const BeamSettings& settings)
        : m_grid(grid),
          m_light(light),
          m_occluders(occluders),
          m_points(sub_texel_points(settings.samples)),
          m_start(ray_start(grid, occluders, settings.clearance)),
          m_open(grid, light.source(), occluders, m_start),
          m_open_texel(gather_texel(0.0, 0.0, nullptr))
    {
    }

    void gather_row(std::size_t y, const BeamArrays& beams) const
    {
        for (std::size_t x = 0; x < m_grid.width; ++x) {
            const auto [irradiance, flow] = texel(x, y);
            beams.irradiance(y, x) = static_cast<float>(irradiance);
            if (beams.direction.data)
                beams.direction(y, x) = Vec3f(mean_direction(flow, static_cast<double>(x), static_cast<double>(y)));
        }
    }

private:
    struct Texel {
        double irradiance;  // W/m^2
        Vec3 flow;          // sum over the points of irradiance times direction of travel
    };

    Texel texel(std::size_t x, std::size_t y) const
    {
        const bool is_open = m_open.is_open(x, y);
        // A sun is the same everywhere.
        if (std::is_same_v<AnyLight, SunLight> && is_open)
            return m_open_texel;
        return gather_texel(static_cast<double>(x), static_cast<double>(y), is_open ? nullptr : m_occluders);
    }

    Texel gather_texel(double x, double y, const Occluders* occluders) const
    {
        Texel sum{};
        for (std::size_t first = 0; first < m_points.size(); first += Occluders::packet_size)
            gather_points(x, y, std::span(m_points).subspan(first), occluders, sum);
        sum.irradiance /= static_cast<double>(m_points.size());
        return sum;
    }

    // Adds the light of as many of the points as make a packet of rays.
    void gather_points(double x, double y, std::span<const Vec2> points, const Occluders* occluders, Texel& sum) const
    {
        std::array<Vec3, Occluders::packet_size> travel;
        std::array<double, Occluders::packet_size> irradiance;
        std::array<ShadowRay, Occluders::packet_size> rays;
        std::size_t count = 0;
        for (const Vec2& sub : points.first(std::min(points.size(), Occluders::packet_size))) {
            const Vec3 point = m_grid.point(x + sub.x, y + sub.y);
            const Arrival arrival = m_light.at(point);
            const double cos_theta = -glm::dot(arrival.travel, m_grid.normal);
            if (!(cos_theta > 0.0) || arrival.flux == 0.0)
                continue;
            travel[count] = arrival.travel;
            irradiance[count] = arrival.flux * cos_theta;
            if (occluders)
                rays[count] = shadow_ray(point, arrival);
            ++count;
        }
        const std::uint32_t blocked = occluders ? occluders->blocked(std::span(rays).first(count)) : 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (blocked >> i & 1u)
                continue;
            sum.irradiance += irradiance[i];
            sum.flow += irradiance[i] * travel[i];
        }
    }

    ShadowRay shadow_ray(const Vec3& point, const Arrival& arrival) const
    {
        const Vec3 lift = m_grid.normal * m_start.height();
        if (std::isinf(arrival.distance))
            return {.origin = point + lift, .direction = -arrival.travel, .distance = arrival.distance};
        const Vec3 way = -arrival.travel * arrival.distance - lift;
        const double distance = glm::length(way);
        // Ending short of the lamp by the same margin: one that touches a surface is not shadowed by it.
        return {.origin = point + lift, .direction = way / distance, .distance = distance - m_start.height()};
    }

    // In the plane frame.
    Vec3 mean_direction(const Vec3& flow, double x, double y) const
    {
        const bool is_lit = glm::dot(flow, flow) > 0.0;
        const Vec3 direction = m_grid.to_plane(is_lit ? flow : m_light.at(m_grid.point(x + 0.5, y + 0.5)).travel);
        return direction.z < 0.0 ? glm::normalize(direction) : Vec3(0.0, 0.0, -1.0);
    }

    const ReceiverGrid& m_grid;
    const AnyLight& m_light;
    const Occluders* m_occluders;
    std::vector<Vec2> m_points;
    RayStart m_start;
    OpenTiles m_open;
    Texel m_open_texel;  // texel (0, 0) with nothing in the way
};

}  // namespace

void compute_beams(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                   const BeamSettings& settings, const BeamArrays& beams, Progress& progress)
{
    grid.check();
    if (settings.samples < 1 || settings.samples > max_beam_samples)
        reject("samples", settings.samples, "1 to " + std::to_string(max_beam_samples));
    if (!(settings.clearance >= 0.0) || std::isinf(settings.clearance))
        reject("clearance", settings.clearance, "a finite length >= 0 in metres");

    progress.set_total(static_cast<double>(grid.height));
    std::visit(
        [&](const auto& any_light) {
            const Gatherer gatherer(grid, any_light, occluders, settings);
            const std::size_t blocks = (grid.height + rows_per_block - 1) / rows_per_block;
            const auto gather_block = [&](std::size_t block) {
                const std::size_t begin = block * rows_per_block;
                const std::size_t end = std::min(begin + rows_per_block, grid.height);
                for (std::size_t y = begin; y < end; ++y)
                    gatherer.gather_row(y, beams);
                progress.advance(static_cast<double>(end - begin));
            };
            with_threads(settings.threads, [&] { parallel_for(blocks, gather_block); });
        },
        light);
    progress.finish();
}

}  // namespace beamspread
