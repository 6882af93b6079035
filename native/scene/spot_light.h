// A spot lamp of the power P in W: the light of a point lamp, with or without a radius, times the falloff of its cone.
//
// Irradiance E = P cos(theta) f / (4 pi d^2) without a radius; P counts the whole sphere, for any cone.
#pragma once

#include "scene/point_light.h"

namespace beamspread {

// Falloff f as a function of the angle gamma between the lamp's -z axis and the ray; with c = cos(gamma) and
// c0 = cos(spot_size / 2), f = smoothstep((c - c0) / ((1 - c0) blend)), and a step at c0 if blend is 0.
enum class SpotFalloff {
    // Measured in Blender 4.2, 4.5, 5.0; the change was made for 3.5 (D17129): c is taken in the lamp's own space, so a
    // scaled lamp has an elliptic cone. (Cycles culls the far side of the cone of a lamp that is sheared by its
    // parents; we do not.)
    scaled,
    // Blender 3.4: the lamp's scale is ignored, and f has a further factor c.
    legacy,
};

class SpotCone {
public:
    // The columns of `lamp_to_world` are the lamp's axes in the world with their scale; the lamp shines along -z.
    // `spot_size` is the full angle of the cone in (0, pi], `blend` lies in [0, 1]. Throws InvalidArgument.
    SpotCone(const Mat3& lamp_to_world, double spot_size, double blend, SpotFalloff falloff);

    // f of light that travels along this unit vector; 0 if it is not a number.
    double falloff(const Vec3& travel) const;

private:
    Mat3 m_world_to_lamp;
    double m_cos_half_size;
    double m_smooth;  // the span of cosines over which the border fades
    SpotFalloff m_falloff;
};

// Light inside the ball of a lamp with a radius does not fall off, but light from the half-space away from its center counts
// half, as in Cycles from Blender 4.0 on: its random rays find a spot only toward its center, while the chance of rays
// sent to the spot is computed as if both kinds found all of it (kernel/light/spot.h). Measured in 4.5: right to 3e-3.
// Beside other lights Cycles sends fewer rays to the spot, and is darker there than this.
class SpotLight final : public Light {
public:
    // Throws InvalidArgument.
    SpotLight(const Vec3& position, const SpotCone& cone, double radius = 0.0, BallShape shape = BallShape::sphere);

    bool is_delta() const override { return m_ball.is_delta(); }
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override { return m_ball.distance_from(point); }
    std::optional<LightSource> source() const override;
    std::vector<LightSource> corners() const override { return m_ball.corners(); }

private:
    // Unit vector from the center to a point; 0 at the center.
    Vec3 outward(const Vec3& point) const;

    // Mean falloff, weighed by cos(theta), over the visible part of the ball above the plane.
    double mean_falloff(const Vec3& point, const Vec3& normal) const;

    PointLight m_ball;
    SpotCone m_cone;
};

}  // namespace beamspread
