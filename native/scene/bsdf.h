// Reflection at one point of a surface.
#pragma once

#include <optional>

#include "base/random.h"
#include "base/vec.h"
#include "scene/ggx.h"
#include "scene/reflector.h"

namespace beamspread {

// Lambert's law and a GGX lobe over it. A layered lobe also reflects the light that single scattering between its facets
// loses (Turquin 2019, "Practical multiple scattering compensation for microfacet models", eq. 16), as in Cycles from
// Blender 4.0 on.
class Bsdf {
public:
    // `normal` and `view` are unit vectors on the same side; `view` points to where light goes.
    Bsdf(const Reflector& reflector, const Vec2f& uv, const Vec3& normal, const Vec3& view);

    // pi times the BSDF, for a unit vector on the side of the normal.
    Vec3f value(const Vec3& direction) const { return m_lobe ? mixed_value(direction) : m_diffuse; }

    // A direction from which light comes.
    struct Sample {
        Vec3 direction{};
        Vec3f weight{};  // the BSDF times the cosine over the density, 0 if no light comes
        bool is_glossy = false;  // drawn from the lobe
    };
    Sample sample(Random& random) const;

private:
    Vec3f mixed_value(const Vec3& direction) const;
    Vec3f lobe_value(const Vec3& local) const;
    Vec3 to_local(const Vec3& direction) const;

    Frame m_frame;
    Vec3f m_diffuse;
    std::optional<GgxLobe> m_lobe;
    Vec3f m_f0{0.0f};
    Vec3f m_lobe_scale{1.0f};
    double m_lobe_part = 0.0;  // probability of directions from the lobe
};

}  // namespace beamspread
