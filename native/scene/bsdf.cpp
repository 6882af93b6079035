#include "scene/bsdf.h"

namespace beamspread {

Bsdf::Bsdf(const Reflector& reflector, const Vec2f& uv, const Vec3& normal, const Vec3& /*view*/)
    : m_normal(normal), m_albedo(reflector.albedo()->at(uv))
{
}

Vec3f Bsdf::value(const Vec3& /*direction*/) const
{
    return m_albedo;
}

Vec3f Bsdf::sample(Random& random, Vec3& direction) const
{
    const double x = random.uniform();
    direction = Frame(m_normal).to_world(cosine_hemisphere({x, random.uniform()}));
    return m_albedo;
}

}  // namespace beamspread
