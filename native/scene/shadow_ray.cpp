#include "scene/shadow_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace beamspread {

namespace {

// Height above the plane where rays start, in units in the last place of the largest coordinate. Rounding of a vertex, of
// a texel's position and of the ray's origin moves each by up to half a unit; Embree's robust test adds a few. Larger
// values lose closer contact: here 2 micrometres in a scene of 1 metre.
constexpr double offset_ulps = 16.0;

// Height of the starts of rays above a face of a mesh that bends, as a fraction of the texel's longer side, besides
// rounding: within a texel the mesh departs from the face. Larger: texels of fine hollows see the light of more of their
// area, and light leaks over rims.
constexpr double bent_clearance = 1e-3;

double rounding_at(double reach)
{
    return offset_ulps * static_cast<double>(std::numeric_limits<float>::epsilon()) * reach;
}

double largest(const Vec3& v)
{
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// True if rounding might put a part of the corners' hull between the grid's texels and the start of rays.
bool may_lie_on(const ReceiverGrid& grid, std::span<const Vec3> corners, double rounding)
{
    Vec3 low(std::numeric_limits<double>::infinity());
    Vec3 high = -low;
    for (const Vec3& corner : corners) {
        const Vec3 position = grid.to_plane(corner - grid.origin);
        low = glm::min(low, position - rounding);
        high = glm::max(high, position + rounding);
    }
    return low.x <= static_cast<double>(grid.width) * grid.pitch_x && high.x >= 0.0 &&
           low.y <= static_cast<double>(grid.height) * grid.pitch_y && high.y >= 0.0 && low.z <= 0.0 && high.z >= 0.0;
}

// True if the box of a mesh that bends meets the box around an instance.
bool may_touch(const BentShape& shape, const Hull& hull)
{
    const Vec3 half = glm::abs(hull.half_axes[0]) + glm::abs(hull.half_axes[1]) + glm::abs(hull.half_axes[2]);
    const Vec3 low = glm::max(shape.low, hull.centre - half);
    const Vec3 high = glm::min(shape.high, hull.centre + half);
    return low.x <= high.x && low.y <= high.y && low.z <= high.z;
}

RayStart ray_start(const ReceiverGrid& grid, const Occluders* occluders, double clearance)
{
    if (!occluders)
        return {.clearance = clearance};
    // World positions have double precision.
    const double in_world = offset_ulps * std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0));
    double rounding = rounding_at(grid.reach(occluders->origin())) + in_world;
    if (grid.is_bent()) {
        // Texels lie on all faces of their own mesh, so that their reach is that of its triangles; instances round more.
        for (const Hull& hull : occluders->hulls())
            if (may_touch(*grid.shape, hull))
                rounding = std::max(rounding, rounding_of(hull) + in_world);
        return {.rounding = rounding, .clearance = clearance};
    }
    // Only triangles that a ray could meet at its start count: large ones far away must not lift the rays.
    const auto include = [&](std::span<const Vec3> corners, double corner_rounding) {
        if (corner_rounding > rounding && may_lie_on(grid, corners, corner_rounding + clearance))
            rounding = corner_rounding;
    };
    for (std::size_t i = 0; i < occluders->own_count(); ++i) {
        const std::array<Vec3, 3> triangle = occluders->triangle(i);
        include(triangle, rounding_of(triangle, occluders->origin()) + in_world);
    }
    for (const Hull& hull : occluders->hulls()) {
        std::array<Vec3, 8> corners;
        for (unsigned i = 0; i < corners.size(); ++i)
            corners[i] = hull.corner(i);
        include(corners, rounding_of(hull) + in_world);
    }
    return {.rounding = rounding, .clearance = clearance};
}

}  // namespace

double height_of_rays(const RayStart& start, const BentTexel& texel)
{
    return start.height() + bent_clearance * texel.pitch();
}

double rounding_of(const std::array<Vec3, 3>& triangle, const Vec3& origin)
{
    return rounding_at(
        std::max({largest(triangle[0] - origin), largest(triangle[1] - origin), largest(triangle[2] - origin)}));
}

double rounding_of(const Hull& hull)
{
    return rounding_at(hull.reach);
}

ReceiverRays::ReceiverRays(const ReceiverGrid& grid, const Occluders* occluders, double clearance)
    : m_grid(grid),
      m_occluders(occluders),
      m_start(ray_start(grid, occluders, clearance)),
      m_contacts(grid, grid.is_bent() ? nullptr : occluders, m_start),
      m_position_rounding(std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0)))
{
    if (!grid.is_bent() || !occluders)
        return;
    m_covered = covered_texels(grid, *occluders, m_start);
    m_open_parts = std::vector<std::atomic<float>>(grid.texels());
    for (std::atomic<float>& part : m_open_parts)
        part.store(-1.0f, std::memory_order_relaxed);
}

// Traces short rays from the middle of a texel to its corners and sides.
double ReceiverRays::find_open_part(const BentTexel& texel) const
{
    constexpr std::array<Vec2, 8> border = {Vec2(0.0, 0.0), Vec2(0.5, 0.0), Vec2(1.0, 0.0), Vec2(1.0, 0.5),
                                            Vec2(1.0, 1.0), Vec2(0.5, 1.0), Vec2(0.0, 1.0), Vec2(0.0, 0.5)};
    if (!texel.is_inside())
        return 1.0;
    const Vec3 middle = texel.position + Vec3(texel.face) * height_of_rays(m_start, texel);
    std::array<ShadowRay, border.size()> rays;
    std::array<SurfaceHit, border.size()> hits;
    for (std::size_t k = 0; k < border.size(); ++k) {
        const Vec3 way = texel.point(border[k].x, border[k].y) - texel.position;
        const double length = glm::length(way);
        rays[k] = {.origin = middle, .direction = way / length, .distance = length};
    }
    // Most texels have no crease, which takes less time to see.
    std::array<Vec3f, border.size()> transmittance;
    m_occluders->transmit(rays, transmittance.data(), false);
    std::size_t blocked = 0;
    for (std::size_t k = 0; k < border.size(); ++k)
        if (transmittance[k] != Vec3f(1.0f))
            rays[blocked++] = rays[k];
    m_occluders->find_surfaces(std::span(rays).first(blocked), hits.data(), true);
    float open = 1.0f;
    for (std::size_t k = 0; k < blocked; ++k) {
        const std::optional<std::size_t> triangle = hits[k].own_opaque;
        if (hits[k].is_hit && (!triangle || m_occluders->owner(*triangle) == m_grid.owner))
            open = std::min(open, static_cast<float>(glm::distance(hits[k].position, middle) / rays[k].distance));
    }
    return static_cast<double>(open);
}

double ReceiverRays::open_part(std::size_t texel) const
{
    if (m_open_parts.empty())
        return 1.0;
    std::atomic<float>& known = m_open_parts[texel];
    float part = known.load(std::memory_order_relaxed);
    if (part < 0.0f) {
        part = static_cast<float>(find_open_part(m_grid.bent_texel(texel)));
        known.store(part, std::memory_order_relaxed);
    }
    return static_cast<double>(part);
}

// `way`: from the start, before it is lifted, to the light, where that has a place.
ShadowRay ReceiverRays::ray_from(const Vec3& start, const Vec3& way, const Vec3& lift, double height,
                                 const LightRay& ray) const
{
    if (std::isinf(ray.distance))
        return {.origin = start + lift, .direction = -ray.travel, .distance = ray.distance};
    const Vec3 lifted = way - lift;
    const double length = glm::length(lifted);
    // The ray ends short of the lamp by the same margin, so that a lamp that touches a surface is not shadowed by it.
    return {.origin = start + lift, .direction = lifted / length, .distance = length - height};
}

// The step to the start of a ray of a mesh that bends, and its length. Below a triangle that lies on the surface, the ray
// starts behind both, and meets it.
std::pair<Vec3, double> ReceiverRays::bent_lift(std::size_t texel) const
{
    const BentTexel& of_mesh = m_grid.bent_texel(texel);
    const double height = height_of_rays(m_start, of_mesh);
    const bool is_covered = !m_covered.empty() && m_covered[texel];
    return {Vec3(of_mesh.face) * (is_covered ? -height : height), height};
}

ShadowRay ReceiverRays::first_ray(std::size_t texel, const Vec3& at, const LightRay& ray) const
{
    const auto [lift, height] = bent_lift(texel);
    return ray_from(at, -ray.travel * ray.distance, lift, height, ray);
}

ShadowRay ReceiverRays::shadow_ray(std::size_t texel, const Vec3& at, const LightRay& ray) const
{
    const Vec3 way = -ray.travel * ray.distance;
    if (m_grid.is_bent()) {
        const auto [lift, height] = bent_lift(texel);
        const Vec3 start = glm::mix(m_grid.bent_texel(texel).position, at, open_part(texel));
        return ray_from(start, way + (at - start), lift, height, ray);
    }
    // As there.
    const double height = m_start.height();
    return ray_from(at, way, m_grid.normal * (m_contacts.cover(at) ? -height : height), height, ray);
}

}  // namespace beamspread
