// Boundaries of the medium for the scalar walk: parallel planes, or a ball whose surface passes through the entry.
//
// Lengths are in mean free paths, positions relative to the entry, and z points into the medium. A curvature k > 0 is a
// ball of radius 1 / k filled with the medium, k < 0 a hollow ball of radius -1 / k in an infinite medium. With
// d(x) = z - k |x|^2 / 2, which is 0 on the surface and positive inside, and B = dd/dt = w.z - k x . w along a direction
// w, d(x + t w) = d + B t - k t^2 / 2: the surface ahead is at a root t, and there the cosine of incidence is
// sqrt(B^2 + 2 k d). The inward normal at a point x of the surface is (0, 0, 1) - k x.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/constants.h"
#include "base/random.h"
#include "base/vec.h"
#include "medium/medium.h"
#include "transport/tally/tally.h"

namespace beamspread {

// The boundary ahead: its distance, and the cosine of incidence there.
struct Ahead {
    double distance;
    double cosine;
};

// Unit vector at this angle from the z axis and a uniform azimuth.
inline Vec3 around_z(double cos_theta, Random& random)
{
    const double phi = 2.0 * pi * random.uniform();
    const double sin_theta = std::sqrt(std::max(0.0, 1.0 - cos_theta * cos_theta));
    return Vec3(sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta);
}

// Directions of sampled connections at one point: proportional to the cosine, inside the cones that can leave.
class FlatCones {
public:
    FlatCones(double exit_cone, bool is_half_space) : m_cone(exit_cone), m_is_half_space(is_half_space) {}

    Vec3 sample(double side, Random& random) const
    {
        const double cos_theta = std::sqrt(1.0 - m_cone * random.uniform());
        return around_z(side * cos_theta, random);
    }

    // Density per steradian of each side.
    double pdf(const Vec3& w) const
    {
        if (m_is_half_space && w.z >= 0.0)
            return 0.0;
        return w.z * w.z > 1.0 - m_cone ? std::abs(w.z) * inv_pi / m_cone : 0.0;
    }

private:
    double m_cone;  // squared sine of the half angle
    bool m_is_half_space;
};

class FlatShape {
public:
    using Cones = FlatCones;

    FlatShape(const Medium& medium, double /*curvature*/)
        : m_thickness(medium.thickness), m_is_half_space(medium.is_half_space())
    {
    }

    // The distance is infinite toward the far side of a half-space.
    Ahead ahead(const Vec3& x, const Vec3& w) const
    {
        const double cosine = std::abs(w.z);
        // The bound on the cosine gives flights along the surface a finite end, which they never reach.
        return {depth(x, w.z) / std::max(cosine, 1e-300), cosine};
    }

    // Distance of the boundary toward -z (`side` below 0) or +z.
    double depth(const Vec3& x, double side) const { return side < 0.0 ? x.z : m_thickness - x.z; }

    // Reflects a direction at a point of the boundary.
    void reflect(Vec3& x, Vec3& w) const
    {
        x.z = w.z < 0.0 ? 0.0 : m_thickness;
        w.z = -w.z;
    }

    Side side_ahead(const Vec3& w) const { return w.z < 0.0 ? Side::reflected : Side::transmitted; }

    // Coordinates (u, v) of an exit.
    Vec2 exit(const Vec3& x, const Vec3& w, double distance) const
    {
        return {x.x + distance * w.x, x.y + distance * w.y};
    }

    Cones cones(const Vec3& /*x*/, double exit_cone) const { return {exit_cone, m_is_half_space}; }

private:
    double m_thickness;
    bool m_is_half_space;
};

// The cone of FlatCones around the outward direction of the nearest point of a ball's surface.
class RoundCone {
public:
    RoundCone(const Vec3& axis, double cone) : m_axis(axis), m_cone(cone) {}

    Vec3 sample(double /*side*/, Random& random) const
    {
        const double cos_theta = std::sqrt(1.0 - m_cone * random.uniform());
        return Frame(m_axis).to_world(around_z(cos_theta, random));
    }

    double pdf(const Vec3& w) const
    {
        const double cosine = glm::dot(w, m_axis);
        return cosine > 0.0 && cosine * cosine > 1.0 - m_cone ? cosine * inv_pi / m_cone : 0.0;
    }

private:
    Vec3 m_axis;
    double m_cone;
};

class RoundShape {
public:
    using Cones = RoundCone;

    RoundShape(const Medium& /*medium*/, double curvature) : m_curvature(curvature) {}

    Ahead ahead(const Vec3& x, const Vec3& w) const
    {
        constexpr Ahead nothing = {std::numeric_limits<double>::infinity(), 1.0};
        const double d = level(x);
        const double b = w.z - m_curvature * glm::dot(x, w);
        const double cosine2 = b * b + 2.0 * m_curvature * d;
        if (m_curvature < 0.0 && (b >= 0.0 || cosine2 < 0.0))
            return nothing;  // away from a hollow, or past it
        const double root = std::sqrt(cosine2);
        const double distance = b < 0.0 ? 2.0 * d / (root - b) : (root + b) / m_curvature;
        return {distance, std::min(root, 1.0)};
    }

    // Distance of the nearest point of the surface.
    double depth(const Vec3& x, double /*side*/) const
    {
        const double d = level(x);
        return 2.0 * d / (1.0 + std::sqrt(std::max(0.0, 1.0 - 2.0 * m_curvature * d)));
    }

    void reflect(Vec3& x, Vec3& w) const
    {
        const Vec3 normal = Vec3(0.0, 0.0, 1.0) - m_curvature * x;
        w -= 2.0 * glm::dot(w, normal) * normal;
    }

    Side side_ahead(const Vec3& /*w*/) const { return Side::reflected; }

    // The chord from the entry, with its azimuth in the tangent plane of the entry.
    Vec2 exit(const Vec3& x, const Vec3& w, double distance) const
    {
        const Vec3 y = x + distance * w;
        const double along2 = y.x * y.x + y.y * y.y;
        if (along2 == 0.0)
            return {std::abs(y.z), 0.0};
        return Vec2(y.x, y.y) * std::sqrt(1.0 + y.z * y.z / along2);
    }

    // The sine of incidence on the surface is the sine to the axis times the distances' ratio from the ball's centre:
    // from inside a ball wider cones leave, from outside a hollow narrower ones. Light that leaves a ball on the far
    // side of its centre is left to the phase function.
    Cones cones(const Vec3& x, double exit_cone) const
    {
        const Vec3 inward = Vec3(0.0, 0.0, 1.0) - m_curvature * x;
        const double ratio2 = std::max(glm::dot(inward, inward), 1e-30);
        return {inward * (-1.0 / std::sqrt(ratio2)), std::min(1.0, exit_cone / ratio2)};
    }

private:
    // d(x); rounding puts points of the surface slightly outside.
    double level(const Vec3& x) const { return std::max(0.0, x.z - 0.5 * m_curvature * glm::dot(x, x)); }

    double m_curvature;
};

}  // namespace beamspread
