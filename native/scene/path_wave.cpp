#include "scene/path_wave.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace beamspread {

namespace {

float largest(const Vec3f& color)
{
    return std::max({color.x, color.y, color.z});
}

}  // namespace

void PathWave::start(const Vec3& origin, const Vec3& direction, std::uint32_t slot, const Random& random)
{
    m_paths.push_back({.origin = origin,
                       .direction = direction,
                       .throughput = Vec3f(1.0f),
                       .slot = slot,
                       .diffuse_bounces = 0,
                       .glossy_bounces = 0,
                       .crossings = 0,
                       .random = random});
}

void PathWave::find(std::size_t first, std::size_t count, bool is_coherent, SurfaceHit* hits)
{
    std::array<ShadowRay, Occluders::packet_size> rays;
    for (std::size_t i = 0; i < count; ++i) {
        const Path& path = m_paths[first + i];
        rays[i] = {path.origin, path.direction, std::numeric_limits<double>::infinity()};
    }
    m_surfaces.find_surfaces(std::span(rays).first(count), hits, is_coherent);
}

void PathWave::trace(std::vector<Vec3f>& radiance)
{
    std::array<SurfaceHit, Occluders::packet_size> hits;
    for (bool is_first = true; !m_paths.empty(); is_first = false) {
        m_rays += m_paths.size();
        std::size_t left = 0;
        for (std::size_t first = 0; first < m_paths.size(); first += Occluders::packet_size) {
            const std::size_t count = std::min(Occluders::packet_size, m_paths.size() - first);
            find(first, count, is_first, hits.data());
            for (std::size_t i = 0; i < count; ++i) {
                Path& path = m_paths[first + i];
                if (hits[i].is_hit && reflect(path, hits[i], radiance))
                    m_paths[left++] = path;
            }
        }
        m_paths.erase(m_paths.begin() + static_cast<std::ptrdiff_t>(left), m_paths.end());
    }
    for (auto& [occluders, waiting] : m_waiting)
        flush(*occluders, waiting, radiance);
}

void PathWave::find_first(std::vector<ShadingPoint>& points)
{
    std::array<SurfaceHit, Occluders::packet_size> hits;
    for (std::size_t first = 0; first < m_paths.size(); first += Occluders::packet_size) {
        const std::size_t count = std::min(Occluders::packet_size, m_paths.size() - first);
        find(first, count, false, hits.data());
        for (std::size_t i = 0; i < count; ++i) {
            const SurfaceHit& hit = hits[i];
            if (hit.is_hit && hit.reflector)
                points.push_back({hit.position, hit.normal, hit.rounding,
                                  Bsdf(*hit.reflector, hit.uv, hit.normal, -m_paths[first + i].direction)});
        }
    }
    m_paths.clear();
}

bool PathWave::reflect(Path& path, const SurfaceHit& hit, std::vector<Vec3f>& radiance)
{
    Vec3f reflected(0.0f);
    Bsdf::Sample drawn;
    if (hit.reflector) {
        const ShadingPoint point{hit.position, hit.normal, hit.rounding,
                                 Bsdf(*hit.reflector, hit.uv, hit.normal, -path.direction)};
        LitRay ray = m_lights.choose(point, path.random);
        ray.radiance *= path.throughput;
        if (ray.radiance != Vec3f(0.0f))
            add(ray, path.slot, radiance);
        drawn = point.bsdf.sample(path.random);
        if (m_limits.allow(path.diffuse_bounces + (drawn.is_glossy ? 0 : 1),
                           path.glossy_bounces + (drawn.is_glossy ? 1 : 0)))
            reflected = path.throughput * drawn.weight;
    }
    const Vec3f crossing =
        path.crossings < m_surfaces.max_crossings() ? path.throughput * hit.transmittance : Vec3f(0.0f);
    const float crosses = largest(crossing);
    const float all = crosses + largest(reflected);
    const float survival = std::min(all, 1.0f);
    const double at = path.random.uniform();
    if (!(at < static_cast<double>(survival)))
        return false;
    // The path crosses with a probability in proportion.
    const bool is_crossing = at * static_cast<double>(all) < static_cast<double>(survival * crosses);
    path.throughput =
        (is_crossing ? crossing : reflected) * (all / (survival * (is_crossing ? crosses : largest(reflected))));
    const double side = is_crossing ? -hit.rounding : hit.rounding;
    path.origin = hit.position + hit.normal * side;
    if (is_crossing) {
        ++path.crossings;
    } else {
        ++(drawn.is_glossy ? path.glossy_bounces : path.diffuse_bounces);
        path.direction = drawn.direction;
    }
    return true;
}

void PathWave::add(const LitRay& ray, std::uint32_t slot, std::vector<Vec3f>& radiance)
{
    if (!ray.occluders) {
        radiance[slot] += ray.radiance;
        return;
    }
    auto waiting = std::ranges::find(m_waiting, ray.occluders, &std::pair<const Occluders*, Waiting>::first);
    if (waiting == m_waiting.end())
        waiting = m_waiting.insert(waiting, {ray.occluders, Waiting{}});
    Waiting& packet = waiting->second;
    packet.rays[packet.count] = ray.shadow_ray;
    packet.radiance[packet.count] = ray.radiance;
    packet.slots[packet.count] = slot;
    packet.records[packet.count] = ray.record;
    if (++packet.count == Occluders::packet_size)
        flush(*ray.occluders, packet, radiance);
}

void PathWave::flush(const Occluders& occluders, Waiting& waiting, std::vector<Vec3f>& radiance)
{
    std::array<Vec3f, Occluders::packet_size> transmittance;
    occluders.transmit(std::span(waiting.rays).first(waiting.count), transmittance.data(), false);
    for (std::size_t i = 0; i < waiting.count; ++i) {
        radiance[waiting.slots[i]] += waiting.radiance[i] * transmittance[i];
        if (!m_records)
            continue;
        m_records->push_back(waiting.records[i]);
        m_records->back().transmittance = (transmittance[i].x + transmittance[i].y + transmittance[i].z) / 3.0f;
    }
    waiting.count = 0;
}

}  // namespace beamspread
