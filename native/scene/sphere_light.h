// A point lamp with a radius R, of the power P in W: far away E = P cos(theta) / (4 pi d^2), as without.
#pragma once

#include "scene/extended_light.h"

namespace beamspread {

class Cone;

// The radiance is P / (4 pi^2 R^2) everywhere on it. Measured in Blender 3.4 and 4.5.
enum class SphereModel {
    // A sphere: Blender 4.5 without soft falloff. Inside of it light comes from everywhere.
    sphere,
    // A disk that faces every point that it lights: Blender 3.4, and 4.5 with soft falloff.
    disk,
};

class SphereLight final : public ExtendedLight {
public:
    // `radius` may be 0. Throws InvalidArgument.
    SphereLight(const Vec3& position, double radius, SphereModel model);
    void sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;

    double distance_from(const Vec3& point) const override { return glm::distance(point, m_position) - m_radius; }

    const Vec3& position() const { return m_position; }
    bool is_inside(const Vec3& point) const;

    // How it looks from a point outside.
    Cone seen_from(const Vec3& point) const;

private:
    Vec3 m_position;
    double m_radius;
    SphereModel m_model;
};

}  // namespace beamspread
