// Where shadow rays start: off the plane, clear of what rounding makes of it.
#pragma once

#include <array>

#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

struct RayStart {
    double rounding = 0.0;  // bound of the rounding of a ray and of the triangles in the grid's plane, metres
    double clearance = 0.0;

    double height() const { return rounding + clearance; }
};

// Bound of the rounding of a triangle, or of the instance in a hull, as rays meet it.
double rounding_of(const std::array<Vec3, 3>& triangle, const Vec3& origin);
double rounding_of(const Hull& hull);

// Towards a light from which light travels along that unit vector to `point` of the grid; the distance may be infinite.
ShadowRay shadow_ray(const ReceiverGrid& grid, const RayStart& start, const Vec3& point, const Vec3& travel,
                     double distance);

// `occluders` may be null.
RayStart ray_start(const ReceiverGrid& grid, const Occluders* occluders, double clearance);

}  // namespace beamspread
