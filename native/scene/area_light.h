// A rectangle or ellipse that shines from its front: the radiance is P / (4 A), P the power in W, A the area; through a
// grid that lets only light of directions within half the spread h pass, (tan(h) - tan(a)) / (tan(h) - h) of it at the
// angle a, by which as much leaves as without.
#pragma once

#include "scene/extended_light.h"

namespace beamspread {

class AreaLight final : public ExtendedLight {
public:
    // The columns of `lamp_to_world` are the lamp's axes in the world with their scale, it shines along -z. The sizes
    // are whole lengths in the lamp's space, its spread a full angle, 0 (parallel light) to pi (no grid). Without an
    // area it is dark. Throws InvalidArgument.
    AreaLight(const Vec3& position, const Mat3& lamp_to_world, double size_x, double size_y, bool is_round,
              double spread);
    void sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override;

private:
    // A part of the lamp that rays are sent to, along its sides, which are 1 long: from there to there.
    struct Part {
        Vec2 low{-0.5, -0.5};
        Vec2 high{0.5, 0.5};
    };

    // How far it is to the plane of the lamp; <= 0: the point is behind.
    double depth(const Vec3& point) const { return glm::dot(point - m_position, m_axis); }
    // Where the point would be seen on the lamp along its axis.
    Vec2 foot(const Vec3& point) const;
    // What of it sends light to the point; false: nothing.
    bool lit_part(const Vec3& point, double depth, Part& part) const;
    bool is_on(const Vec2& place) const;
    double through_grid(double cos_angle) const;
    // The integral of cos(theta) over the directions in which the point sees it, times what comes through the grid; of
    // one azimuth from the axis up to an angle of that tangent, where cos(theta) = along cos(a) + across sin(a).
    double up_to(double along, double across, double tangent) const;
    double seen(const Vec3& point, const Vec3& normal, double depth) const;
    LightRay ray(const Vec3& way, const Vec2& place, double flux) const;

    Vec3 m_position;
    Vec3 m_side_x, m_side_y;  // whole
    Vec3 m_axis;  // light leaves around it
    bool m_is_round;
    double m_area;
    double m_radiance;
    double m_half_spread;
    double m_tan_spread;  // of half of it
};

}  // namespace beamspread
