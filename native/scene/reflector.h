// Light that a surface reflects: Lambert's law with a texture, and a GGX lobe over it.
#pragma once

#include <memory>

#include "scene/color_texture.h"

namespace beamspread {

// Reflection of one material, the same on both sides.
class Reflector {
public:
    // `albedo` is not null; `f0`: reflectance of the lobe at normal incidence, 0 to 1 in each channel, 0: no lobe;
    // `roughness` as in Cycles, 0 to 1. `is_layered`: the lobe takes its light from the diffuse part, otherwise both add
    // up. Throws InvalidArgument.
    Reflector(std::shared_ptr<const ColorTexture> albedo, const Vec3f& f0, double roughness, bool is_layered);

    const std::shared_ptr<const ColorTexture>& albedo() const { return m_albedo; }
    const Vec3f& f0() const { return m_f0; }
    double roughness() const { return m_roughness; }
    bool is_layered() const { return m_is_layered; }

private:
    std::shared_ptr<const ColorTexture> m_albedo;
    Vec3f m_f0;
    double m_roughness;
    bool m_is_layered;
};

}  // namespace beamspread
