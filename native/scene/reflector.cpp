#include "scene/reflector.h"

#include <utility>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

Reflector::Reflector(std::shared_ptr<const ColorTexture> albedo, const Vec3f& f0, double roughness, bool is_layered)
    : m_albedo(std::move(albedo)), m_f0(f0), m_roughness(roughness), m_is_layered(is_layered)
{
    for (int i = 0; i < 3; ++i)
        if (!(f0[i] >= 0.0f && f0[i] <= 1.0f))
            reject("f0", detail::to_text(f0), "0 to 1 in each channel");
    if (!(roughness >= 0.0 && roughness <= 1.0))
        reject("roughness", roughness, "0 to 1");
}

}  // namespace beamspread
