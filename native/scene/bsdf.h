// Reflection at one point of a surface.
#pragma once

#include "base/constants.h"
#include "base/random.h"
#include "base/vec.h"
#include "scene/reflector.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

class Bsdf {
public:
    // A black surface.
    Bsdf() = default;

    // `normal` and `view` are unit vectors on the same side; `view` points to where light goes.
    Bsdf(const Reflector& reflector, const Vec2f& uv, const Vec3& normal, const Vec3& view);

    // Radiance toward the viewer over irradiance from `direction`, times pi.
    Vec3f value(const Vec3& direction) const;

    // Draws a direction from which light comes; returns the BSDF times the cosine over the density, 0 if none.
    Vec3f sample(Random& random, Vec3& direction) const;

private:
    Vec3 m_normal{0.0, 0.0, 1.0};
    Vec3f m_albedo{0.0f};
};

}  // namespace beamspread
