// Light paths that are traced together, from nodes to the surfaces that they meet.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/random.h"
#include "scene/light_choice.h"
#include "scene/occluders.h"

namespace beamspread {

// Largest numbers of surfaces that reflect light on its way to a receiver, as Cycles counts them: the last ray, to the
// receiver, is the first diffuse one.
struct BounceLimits {
    int all = 12;
    int diffuse = 12;
    int glossy = 12;

    bool allow(int diffuse_bounces, int glossy_bounces) const
    {
        return diffuse_bounces < diffuse && glossy_bounces <= glossy && diffuse_bounces + glossy_bounces < all;
    }
};

// Path tracing with next-event estimation (Kajiya 1986, doi:10.1145/15922.15902): at each surface one shadow ray adds
// light, then the path goes on by the BSDF. Light that paths meet directly does not count. Russian roulette ends paths that
// carry little light, without bias.
class PathWave {
public:
    // `surfaces` and `lights` must outlive the object.
    PathWave(const Occluders& surfaces, const LightChoice& lights, const BounceLimits& limits)
        : m_surfaces(surfaces), m_lights(lights), m_limits(limits)
    {
    }

    // Starts a path along a unit vector; the radiance that it finds is added to that slot.
    void start(const Vec3& origin, const Vec3& direction, std::uint32_t slot, const Random& random);

    // Traces all paths and adds radiance, W/(m^2 sr), to the slots; paths that follow each other should run alike.
    void trace(std::vector<Vec3f>& radiance);

    // Keeps records of shadow rays for a guide; it must outlive the paths.
    void record(std::vector<GuideRecord>* records) { m_records = records; }

    // Number of rays along paths so far, without shadow rays.
    std::size_t rays() const { return m_rays; }

    // Traces only the first part of all paths and writes the surfaces that they meet.
    void find_first(std::vector<ShadingPoint>& points);

private:
    struct Path {
        Vec3 origin;
        Vec3 direction;
        Vec3f throughput;
        std::uint32_t slot;
        std::int32_t diffuse_bounces;
        std::int32_t glossy_bounces;
        std::int32_t crossings;
        Random random;
    };

    // Shadow rays that wait for a packet, all toward lights with the same occluders.
    struct Waiting {
        std::array<ShadowRay, Occluders::packet_size> rays;
        std::array<Vec3f, Occluders::packet_size> radiance;
        std::array<std::uint32_t, Occluders::packet_size> slots;
        std::array<GuideRecord, Occluders::packet_size> records;
        std::size_t count = 0;
    };

    // Finds the surface of each of a few paths.
    void find(std::size_t first, std::size_t count, bool is_coherent, SurfaceHit* hits);
    // Adds light at a surface and turns the path; returns false at its end.
    bool reflect(Path& path, const SurfaceHit& hit, std::vector<Vec3f>& radiance);
    void add(const LitRay& ray, std::uint32_t slot, std::vector<Vec3f>& radiance);
    void flush(const Occluders& occluders, Waiting& waiting, std::vector<Vec3f>& radiance);

    const Occluders& m_surfaces;
    const LightChoice& m_lights;
    BounceLimits m_limits;
    std::vector<Path> m_paths;
    std::size_t m_rays = 0;
    std::vector<std::pair<const Occluders*, Waiting>> m_waiting;
    std::vector<GuideRecord>* m_records = nullptr;
};

}  // namespace beamspread
