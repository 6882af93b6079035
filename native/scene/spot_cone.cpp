#include "scene/spot_cone.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

double smoothstep(double t)
{
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

}  // namespace

SpotCone::SpotCone(const Mat3& lamp_to_world, double spot_size, double blend, SpotFalloff falloff)
    : m_world_to_lamp(glm::inverse(lamp_to_world)),
      m_cos_half_size(std::cos(0.5 * spot_size)),
      m_smooth((1.0 - m_cos_half_size) * blend),
      m_falloff(falloff)
{
    if (!(spot_size > 0.0 && spot_size <= detail::max_angle))
        reject("spot_size", spot_size, "0 < spot_size <= pi, the full angle in radians");
    if (!(blend >= 0.0 && blend <= 1.0))
        reject("blend", blend, "0 to 1");
    for (int i = 0; i < 3; ++i) {
        if (!detail::is_finite(m_world_to_lamp[i]))
            reject("frame", "singular or not finite", "three axes that span space");
    }
    if (falloff == SpotFalloff::legacy) {
        // Only the last row is used: minus the cosine to the lamp's own z axis.
        const Vec3 z = glm::normalize(lamp_to_world[2]);
        m_world_to_lamp = glm::transpose(Mat3(Vec3(0.0), Vec3(0.0), z));
    }
}

double SpotCone::falloff(const Vec3& travel) const
{
    const Vec3 local = m_world_to_lamp * travel;
    const double cos_theta = m_falloff == SpotFalloff::scaled ? -local.z / glm::length(local) : -local.z;
    // Also leaves where `travel` is 0 and the cosine is not a number.
    if (!(cos_theta > m_cos_half_size))
        return 0.0;
    const double border = m_smooth > 0.0 ? smoothstep((cos_theta - m_cos_half_size) / m_smooth) : 1.0;
    return m_falloff == SpotFalloff::scaled ? border : border * cos_theta;
}

}  // namespace beamspread
