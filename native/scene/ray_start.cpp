#include "scene/ray_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace beamspread {

namespace {

// Rounding of a vertex, of a texel's position and of the ray's origin moves each by up to half a unit in the last place
// of the largest coordinate; Embree's robust test adds a few. Starting this many units off the plane keeps a ray clear
// of the receiver's own triangles, and is far below what can be seen: 2 micrometres in a scene of 1 metre. With 2 and
// more, tests/unit/test_scene_contact.py and test_scene_instances.py pass, with 1 they don't.
constexpr double offset_ulps = 16.0;

double rounding_at(double reach)
{
    return offset_ulps * static_cast<double>(std::numeric_limits<float>::epsilon()) * reach;
}

double largest(const Vec3& v)
{
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

// Whether rounding might put a part of what lies between the corners between the grid's texels and where rays start.
bool may_lie_on(const ReceiverGrid& grid, std::span<const Vec3> corners, double rounding)
{
    Vec3 low(std::numeric_limits<double>::infinity());
    Vec3 high = -low;
    for (const Vec3& corner : corners) {
        const Vec3 place = grid.to_plane(corner - grid.origin);
        low = glm::min(low, place - rounding);
        high = glm::max(high, place + rounding);
    }
    return low.x <= static_cast<double>(grid.width) * grid.pitch_x && high.x >= 0.0 &&
           low.y <= static_cast<double>(grid.height) * grid.pitch_y && high.y >= 0.0 && low.z <= 0.0 && high.z >= 0.0;
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

ShadowRay shadow_ray(const ReceiverGrid& grid, const RayStart& start, const Vec3& point, const Vec3& travel,
                     double distance)
{
    const Vec3 lift = grid.normal * start.height();
    if (std::isinf(distance))
        return {.origin = point + lift, .direction = -travel, .distance = distance};
    const Vec3 way = -travel * distance - lift;
    const double length = glm::length(way);
    // Ending short of the lamp by the same margin: one that touches a surface is not shadowed by it.
    return {.origin = point + lift, .direction = way / length, .distance = length - start.height()};
}

RayStart ray_start(const ReceiverGrid& grid, const Occluders* occluders, double clearance)
{
    if (!occluders)
        return {.clearance = clearance};
    // Positions in the world are in double precision.
    const double in_world = offset_ulps * std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0));
    double rounding = rounding_at(grid.reach(occluders->origin())) + in_world;
    // Large triangles far away must not lift the rays: only those that a ray could meet where it starts count.
    const auto include = [&](std::span<const Vec3> corners, double own) {
        if (own > rounding && may_lie_on(grid, corners, own + clearance))
            rounding = own;
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

}  // namespace beamspread
