// What occluders are made of: a mesh, the places where it stands, and what its triangles let through.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/transmittance.h"

namespace beamspread {

// Three indices of vertices.
using Triangle = std::array<std::uint32_t, 3>;

// From a mesh to the world: linear x + translation.
struct Placement {
    Mat3 linear{1.0};
    Vec3 translation{};

    Vec3 operator()(const Vec3& point) const { return linear * point + translation; }
};

// Views of arrays that only have to live while occluders are made; `transmittances` are kept.
struct OccluderMesh {
    std::span<const Vec3> vertices{};
    std::span<const Triangle> triangles{};
    std::vector<Placement> placements{Placement{}};

    // What the i-th material lets through, and the material of each triangle: of none, all are opaque.
    std::vector<std::shared_ptr<const Transmittance>> transmittances{};
    std::span<const std::uint32_t> materials{};
    std::span<const std::array<Vec2f, 3>> uvs{};  // of each triangle's corners; of none, all are at (0, 0)

    // Null where a triangle is opaque.
    const Transmittance* transmittance(std::size_t triangle) const
    {
        if (materials.empty())
            return nullptr;
        const Transmittance* const found = transmittances[materials[triangle]].get();
        return found->is_opaque() ? nullptr : found;
    }

    // Throws InvalidArgument.
    void check() const;
};

}  // namespace beamspread
