#include "scene/shadow_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace beamspread {

namespace {

// Height above the plane where rays start, in units in the last place of the largest coordinate. Rounding of a vertex, of
// a texel's position and of the ray's origin moves each by up to half a unit; Embree's robust test adds a few. Larger
// values lose closer contact: here 2 micrometres in a scene of 1 metre.
constexpr double offset_ulps = 16.0;

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

RayStart ray_start(const ReceiverGrid& grid, const Occluders* occluders, double clearance)
{
    if (!occluders)
        return {.clearance = clearance};
    // World positions have double precision.
    const double in_world = offset_ulps * std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0));
    double rounding = rounding_at(grid.reach(occluders->origin())) + in_world;
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
      m_start(ray_start(grid, occluders, clearance)),
      m_contacts(grid, occluders, m_start),
      m_position_rounding(std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0)))
{
}

ShadowRay ReceiverRays::shadow_ray(const Vec3& point, const LightRay& ray) const
{
    // Below a triangle that lies on the plane, the ray starts behind both, and meets it.
    const Vec3 lift = m_grid.normal * (m_contacts.cover(point) ? -m_start.height() : m_start.height());
    if (std::isinf(ray.distance))
        return {.origin = point + lift, .direction = -ray.travel, .distance = ray.distance};
    const Vec3 way = -ray.travel * ray.distance - lift;
    const double length = glm::length(way);
    // The ray ends short of the lamp by the same margin, so that a lamp that touches a surface is not shadowed by it.
    return {.origin = point + lift, .direction = way / length, .distance = length - m_start.height()};
}

}  // namespace beamspread
