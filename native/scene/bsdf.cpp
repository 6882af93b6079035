#include "scene/bsdf.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

namespace {

// Smallest cosine of the view to the normal: the lobe divides by it.
constexpr double min_view_cosine = 1e-4;

float mean(const Vec3f& color)
{
    return (color.x + color.y + color.z) / 3.0f;
}

}  // namespace

Bsdf::Bsdf(const Reflector& reflector, const Vec2f& uv, const Vec3& normal, const Vec3& view)
    : m_frame(normal), m_diffuse(reflector.albedo()->at(uv)), m_f0(reflector.f0())
{
    if (m_f0 == Vec3f(0.0f))
        return;
    Vec3 local = to_local(view);
    local.z = std::max(local.z, min_view_cosine);
    local = glm::normalize(local);
    const double alpha = std::max(reflector.roughness() * reflector.roughness(), min_alpha);
    m_lobe.emplace(local, alpha);
    const LobeAlbedo albedo = lobe_albedo(local.z, alpha);
    Vec3f reflected = m_f0 * static_cast<float>(albedo.even - albedo.edge) + static_cast<float>(albedo.edge);
    if (reflector.is_layered()) {
        m_lobe_scale = 1.0f + m_f0 * static_cast<float>((1.0 - albedo.even) / albedo.even);
        reflected *= m_lobe_scale;
        m_diffuse *= std::max(1.0f - std::max({reflected.x, reflected.y, reflected.z}), 0.0f);
    }
    const float all = mean(reflected) + mean(m_diffuse);
    m_lobe_part = static_cast<double>(mean(reflected) / all);
}

Vec3 Bsdf::to_local(const Vec3& direction) const
{
    return {glm::dot(direction, m_frame.x), glm::dot(direction, m_frame.y), glm::dot(direction, m_frame.z)};
}

Vec3f Bsdf::lobe_value(const Vec3& local) const
{
    const auto edge = static_cast<float>(schlick_weight(m_lobe->half_cosine(local)));
    const Vec3f fresnel = m_f0 + (1.0f - m_f0) * edge;
    return fresnel * m_lobe_scale * static_cast<float>(m_lobe->value(local));
}

Vec3f Bsdf::mixed_value(const Vec3& direction) const
{
    const Vec3 local = to_local(direction);
    return local.z > 0.0 ? m_diffuse + lobe_value(local) : Vec3f(0.0f);
}

Bsdf::Sample Bsdf::sample(Random& random) const
{
    const bool from_lobe = m_lobe && random.uniform() < m_lobe_part;
    const double x = random.uniform();
    const Vec2 place(x, random.uniform());
    const Vec3 local = from_lobe ? m_lobe->sample(place) : cosine_hemisphere(place);
    Sample drawn{.direction = m_frame.to_world(local), .weight = m_diffuse, .is_glossy = from_lobe};
    if (!m_lobe)
        return drawn;
    drawn.weight = Vec3f(0.0f);
    if (!(local.z > 0.0))
        return drawn;
    // One-sample multiple importance sampling with the balance heuristic (Veach 1997, section 9.2.4).
    const double density = m_lobe_part * m_lobe->density(local) + (1.0 - m_lobe_part) * inv_pi * local.z;
    drawn.weight = (m_diffuse + lobe_value(local)) * static_cast<float>(inv_pi * local.z / density);
    return drawn;
}

}  // namespace beamspread
