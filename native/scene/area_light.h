// An area lamp: a rectangle or ellipse that shines from its front, of the power P in W.
//
// The radiance is P / (4 A), A the area. A spread of less than pi puts a grid in front of the lamp, which keeps the power:
// with h half the spread, it scales radiance at the angle a to the axis by (tan(h) - tan(a)) / (tan(h) - h), and by 0
// beyond h.
#pragma once

#include "scene/light.h"

namespace beamspread {

class AreaLight final : public Light {
public:
    // The columns of `lamp_to_world` are the lamp's axes in the world with their scale; the lamp shines along -z. The
    // sizes are whole lengths in the lamp's space, the spread is a full angle, 0 (parallel light) to pi (no grid). A
    // lamp without an area is dark. Throws InvalidArgument.
    AreaLight(const Vec3& position, const Mat3& lamp_to_world, double size_x, double size_y, bool is_round,
              double spread);
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override;
    std::vector<LightSource> corners() const override;

private:
    // The part of the lamp that rays are sent to, in coordinates along its sides, each from -0.5 to 0.5.
    struct Part {
        Vec2 low{-0.5, -0.5};
        Vec2 high{0.5, 0.5};
    };

    // Distance of a point to the plane of the lamp, metres; <= 0: the point is behind.
    double depth(const Vec3& point) const { return glm::dot(point - m_position, m_axis); }
    // Projection of a point on the lamp along its axis.
    Vec2 foot(const Vec3& point) const;
    // Finds the part of the lamp that sends light to the point; false if none does.
    bool lit_part(const Vec3& point, double depth, Part& part) const;
    bool is_on(const Vec2& place) const;
    double through_grid(double cos_angle) const;
    // The integral of cos(theta), times the factor of the grid, over directions of one azimuth from the axis up to an
    // angle of that tangent, where cos(theta) = along cos(a) + across sin(a).
    double up_to(double along, double across, double tangent) const;
    // The same integral over all directions in which the point sees the lamp.
    double seen(const Vec3& point, const Vec3& normal, double depth) const;
    LightRay ray_from(const Vec3& point, const Vec3& normal, const Vec2& at) const;
    // A ray of this solid angle along `way`, which ends at a place of the lamp.
    LightRay ray(const Vec3& way, const Vec2& place, double solid_angle) const;

    Vec3 m_position;
    Vec3 m_side_x, m_side_y;  // whole sides, metres
    Vec3 m_axis;  // the middle of the directions in which light leaves
    bool m_is_round;
    double m_area;
    double m_radiance;
    double m_half_spread;
    double m_tan_spread;  // of half of it
};

}  // namespace beamspread
