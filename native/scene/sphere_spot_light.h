// A spot lamp with a radius: the light of the sphere times the falloff of each ray. Inside of the sphere nothing falls off.
#pragma once

#include "scene/sphere_light.h"
#include "scene/spot_cone.h"

namespace beamspread {

class SphereSpotLight final : public ExtendedLight {
public:
    // Throws InvalidArgument.
    SphereSpotLight(const Vec3& position, const SpotCone& cone, double radius, SphereModel model);
    void sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override { return m_sphere.distance_from(point); }

private:
    // Over what a point sees of the sphere above the plane.
    double mean_falloff(const Vec3& point, const Vec3& normal) const;

    SphereLight m_sphere;
    SpotCone m_cone;
};

}  // namespace beamspread
