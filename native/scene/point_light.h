// A point lamp of the power P in W, with or without a radius R.
//
// Irradiance E = P cos(theta) / (4 pi d^2) of a point, at distance d. With a radius, the radiance is P / (4 pi^2 R^2)
// everywhere on the ball, so that E is the same far away. The lamp's scale does not count.
#pragma once

#include "scene/light.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

// Shape of a lamp with a radius, measured in Blender 3.4 and 4.5.
enum class BallShape {
    // A sphere: Blender 4.5 without soft falloff. Light comes from everywhere inside of it.
    sphere,
    // A disk that faces every point that it lights: Blender 3.4, and 4.5 with soft falloff.
    disk,
};

class PointLight final : public Light {
public:
    // Throws InvalidArgument.
    explicit PointLight(const Vec3& position, double radius = 0.0, BallShape shape = BallShape::sphere);

    bool is_delta() const override { return m_radius == 0.0; }
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override { return glm::distance(point, m_position) - m_radius; }
    std::optional<LightSource> source() const override;

    std::vector<LightSource> corners() const override;

    const Vec3& position() const { return m_position; }

    // True if the point lies in the ball.
    bool is_inside(const Vec3& point) const;

    // The cone of directions in which a point outside sees the ball.
    Cone seen_from(const Vec3& point) const;

private:
    LightRay ray_inside(const Vec3& point, const Vec3& normal, const Vec2& place) const;
    LightRay ray_outside(const Vec3& point, const Vec2& place) const;

    Vec3 m_position;
    double m_radius;
    BallShape m_shape;
};

}  // namespace beamspread
