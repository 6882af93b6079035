// A spot lamp with a radius: the light of the sphere times the falloff of each ray. Inside of the sphere nothing falls off,
// but what arrives from the half-space away from its centre counts half. So it is in Cycles (Blender 4.0 on, which has
// spheres), whose rays by chance find a spot toward its centre alone, while the chance of those sent to it is reckoned as if
// both found all of it (kernel/light/spot.h). Measured in 4.5: right to 3e-3. Where other lights shine, fewer rays are sent
// to the spot, and Cycles' own is darker than this.
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
    // A point's direction from the centre, 0 at the centre.
    Vec3 outward(const Vec3& point) const;

    // Over what a point sees of the sphere above the plane.
    double mean_falloff(const Vec3& point, const Vec3& normal) const;

    SphereLight m_sphere;
    SpotCone m_cone;
};

}  // namespace beamspread
