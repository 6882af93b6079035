// Meshes that block light, the instances of each, and the light that their triangles let through or reflect.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/color_texture.h"
#include "scene/reflector.h"

namespace beamspread {

// Indices of three vertices.
using Triangle = std::array<std::uint32_t, 3>;

// Transform from a mesh to the world: linear x + translation.
struct Placement {
    Mat3 linear{1.0};
    Vec3 translation{};
    std::uint32_t owner = 0;  // number of the object that has the mesh here

    Vec3 operator()(const Vec3& point) const { return linear * point + translation; }
};

// A mesh as views of arrays, which must outlive the making of occluders; `transmittances` are shared.
struct OccluderMesh {
    std::span<const Vec3> vertices{};
    std::span<const Triangle> triangles{};
    std::vector<Placement> placements{Placement{}};

    // The transmittance of each material, and the material of each triangle. Without either all triangles are opaque.
    std::vector<std::shared_ptr<const ColorTexture>> transmittances{};
    std::span<const std::uint32_t> materials{};
    std::span<const std::array<Vec2f, 3>> uvs{};  // of each triangle's corners; empty: all are (0, 0)

    // The reflection of each material, null if it is black; empty: all are black. Without materials all triangles have the
    // first.
    std::vector<std::shared_ptr<const Reflector>> reflectors{};
    std::span<const std::array<Vec2f, 3>> reflector_uvs{};  // as `uvs`

    // The transmittance of a triangle; null if it is opaque.
    const ColorTexture* transmittance(std::size_t triangle) const
    {
        if (materials.empty() || transmittances.empty())
            return nullptr;
        const ColorTexture* const transmittance = transmittances[materials[triangle]].get();
        return transmittance->is_black() ? nullptr : transmittance;
    }

    // The reflection of a triangle; null if it is black.
    const Reflector* reflector(std::size_t triangle) const
    {
        return reflectors.empty() ? nullptr : reflectors[materials.empty() ? 0 : materials[triangle]].get();
    }

    // Throws InvalidArgument.
    void check() const;

private:
    void check_uvs(const char* name, std::span<const std::array<Vec2f, 3>> values) const;
};

}  // namespace beamspread
