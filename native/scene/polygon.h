// Polygons of even radiance as seen from a point.
#pragma once

#include <span>

#include "base/vec.h"

namespace beamspread {

// Of a plane with that normal at the origin, by radiance 1 from a flat convex polygon of at least 3 corners: the
// integral of cos(theta) over what it covers of the half above the plane (Lambert 1760).
double polygon_irradiance(std::span<const Vec3> corners, const Vec3& normal);

// A rectangle as seen from the origin, sampled evenly over its solid angle (Urena, Fajardo, King 2013, "An
// area-preserving parametrization for spherical rectangles").
class SphericalRectangle {
public:
    // One corner, and the sides from there, at right angles.
    SphericalRectangle(const Vec3& corner, const Vec3& side_x, const Vec3& side_y);

    double solid_angle() const { return m_solid_angle; }

    // The point of the rectangle for a place of the unit square.
    Vec3 point(const Vec2& place) const;

private:
    Vec3 m_x, m_y, m_z;  // z points away from the rectangle
    double m_x0, m_x1, m_y0, m_y1, m_z0;  // what it spans in that frame
    double m_b0, m_b1, m_k;  // as in the paper
    double m_solid_angle;
};

}  // namespace beamspread
