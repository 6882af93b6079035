// A round cone of directions of even radiance: how a sphere, a disk that faces the viewer and a sun look from a point.
#pragma once

#include "base/vec.h"

namespace beamspread {

class Cone {
public:
    // `axis` a unit vector; the half angle, at most pi / 2, by its squared sine.
    Cone(const Vec3& axis, double sin_squared);

    // Steradians.
    double solid_angle() const;

    // A direction for a place of the unit square, evenly over the solid angle; `along` is its cosine to the axis.
    Vec3 direction(const Vec2& place, double& along) const;

    // Evenly over a flat disk around the axis at the distance 1, whose squared radius is given.
    Vec3 tangent(const Vec2& place, double radius_squared) const;

    // Of a plane with that normal, by radiance 1: the integral of cos(theta) over the part above the plane.
    double irradiance(const Vec3& normal) const;

    const Vec3& axis() const { return m_frame.z; }

private:
    Frame m_frame;
    double m_sin_squared;
    double m_one_minus_cos;  // of the half angle
};

// A direction above z = 0, evenly over the projected solid angle.
Vec3 cosine_hemisphere(const Vec2& place);

}  // namespace beamspread
