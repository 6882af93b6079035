// Cones, polygons and rectangles as seen from a point: their irradiance in closed form, and their directions.
#pragma once

#include <array>
#include <span>

#include "base/vec.h"

namespace beamspread {

// A round cone of directions of even radiance: how a sphere, a disk that faces the viewer and a sun look from a point.
class Cone {
public:
    // `axis` is a unit vector; the half angle, at most pi / 2, is given by its squared sine.
    Cone(const Vec3& axis, double sin_squared);

    // Solid angle, steradians.
    double solid_angle() const;

    // A direction for a place of the unit square, evenly over the solid angle; `along` is its cosine to the axis.
    Vec3 direction(const Vec2& place, double& along) const;

    // A direction evenly over a flat disk around the axis at distance 1, of this squared radius.
    Vec3 tangent(const Vec2& place, double radius_squared) const;

    // The integral of cos(theta) over the part of the cone above a plane with that normal: irradiance by radiance 1.
    double irradiance(const Vec3& normal) const;

    const Vec3& axis() const { return m_frame.z; }

private:
    Frame m_frame;
    double m_sin_squared;
    double m_one_minus_cos;  // of the half angle
};

// A direction above z = 0, evenly over the projected solid angle.
Vec3 cosine_hemisphere(const Vec2& place);

// Irradiance of a plane with that normal at the origin by a flat convex polygon of radiance 1, of at least 3 corners: the
// integral of cos(theta) over the part above the plane (Lambert 1760).
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
    Vec3 m_x, m_y, m_z;                   // z points away from the rectangle
    double m_x0, m_x1, m_y0, m_y1, m_z0;  // extent of the rectangle in that frame
    double m_b0, m_b1, m_k;               // as in the paper
    double m_solid_angle;
};

// A triangle as seen from the origin, sampled evenly over its solid angle (Arvo 1995, "Stratified sampling of spherical
// triangles", doi:10.1145/218380.218500).
class SphericalTriangle {
public:
    // Corners, none of them at the origin.
    explicit SphericalTriangle(const std::array<Vec3, 3>& corners);

    // Solid angle, steradians; 0 if the triangle is seen along its plane.
    double solid_angle() const { return m_solid_angle; }

    // The unit vector to the point of the triangle for a place of the unit square; the solid angle is above 0.
    Vec3 direction(const Vec2& place) const;

private:
    Vec3 m_a, m_b, m_c;  // unit vectors
    double m_cos_alpha = 1.0, m_sin_alpha = 0.0;  // angle at a
    double m_solid_angle = 0.0;
};

}  // namespace beamspread
