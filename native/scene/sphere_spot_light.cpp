#include "scene/sphere_spot_light.h"

#include "scene/quadrature.h"

namespace beamspread {

SphereSpotLight::SphereSpotLight(const Vec3& position, const SpotCone& cone, double radius, SphereModel model)
    : m_sphere(position, radius, model), m_cone(cone)
{
}

void SphereSpotLight::sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const
{
    m_sphere.sample(point, normal, square, rays);
    if (m_sphere.is_inside(point))
        return;
    for (LightRay& ray : std::span(rays, square.size()))
        ray.flux *= static_cast<float>(m_cone.falloff(ray.travel));
}

Vec3 SphereSpotLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    // The sphere's, which is exact, times the mean falloff.
    const double whole = mean_irradiance(m_sphere, point, normal).x;
    if (!(whole > 0.0))
        return Vec3(0.0);
    return m_sphere.irradiance(point, normal) * (mean_irradiance(*this, point, normal).x / whole);
}

}  // namespace beamspread
