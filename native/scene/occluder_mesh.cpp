#include "scene/occluder_mesh.h"

#include <cmath>
#include <string>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Largest UV coordinate: single precision can't tell texels apart beyond.
constexpr float max_uv = 1e6f;

}  // namespace

void OccluderMesh::check_uvs(const char* name, std::span<const std::array<Vec2f, 3>> values) const
{
    if (!values.empty() && values.size() != triangles.size())
        reject(name, std::to_string(values.size()) + " triangles",
               "one for each of " + std::to_string(triangles.size()) + " triangles");
    for (const auto& corners : values)
        for (const Vec2f& uv : corners)
            for (const float part : {uv.x, uv.y})
                if (!(std::abs(part) <= max_uv))
                    reject(name, static_cast<double>(part), "-1e6 to 1e6");
}

void OccluderMesh::check() const
{
    for (const Vec3& vertex : vertices)
        detail::check_finite("vertices", vertex, "finite coordinates within 1e18 m of the origin");
    for (const Triangle& triangle : triangles)
        for (const std::uint32_t index : triangle)
            detail::check_index("triangles", index, "vertices", vertices.size());
    for (const Placement& placement : placements)
        for (const Vec3& row : {placement.linear[0], placement.linear[1], placement.linear[2], placement.translation})
            detail::check_finite("placements", row, "finite numbers");
    if (!materials.empty() && materials.size() != triangles.size())
        reject("materials", std::to_string(materials.size()) + " numbers",
               "one for each of " + std::to_string(triangles.size()) + " triangles");
    for (const std::uint32_t material : materials) {
        if (!transmittances.empty() || reflectors.empty())
            detail::check_index("materials", material, "transmittances", transmittances.size());
        if (!reflectors.empty())
            detail::check_index("materials", material, "reflectors", reflectors.size());
    }
    check_uvs("uvs", uvs);
    check_uvs("reflector_uvs", reflector_uvs);
}

}  // namespace beamspread
