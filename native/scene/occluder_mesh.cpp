#include "scene/occluder_mesh.h"

#include <string>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Beyond, single precision has no digits left to tell texels apart.
constexpr float max_uv = 1e6f;

void check_uv(const Vec2f& uv)
{
    if (!(glm::abs(uv.x) <= max_uv && glm::abs(uv.y) <= max_uv))
        reject("uvs", static_cast<double>(glm::abs(uv.x) <= max_uv ? uv.y : uv.x), "-1e6 to 1e6");
}

}  // namespace

void OccluderMesh::check() const
{
    for (const Vec3& vertex : vertices) {
        if (!detail::is_finite(vertex))
            reject("vertices", detail::to_text(vertex), "finite coordinates within 1e18 m of the origin");
    }
    for (const Triangle& triangle : triangles) {
        for (const std::uint32_t index : triangle) {
            if (index >= vertices.size())
                reject("triangles", std::to_string(index),
                       "indices below the number of vertices, " + std::to_string(vertices.size()));
        }
    }
    for (const Placement& placement : placements) {
        for (const Vec3& row : {placement.linear[0], placement.linear[1], placement.linear[2], placement.translation}) {
            if (!detail::is_finite(row))
                reject("placements", detail::to_text(row), "finite numbers");
        }
    }
    if (!materials.empty() && materials.size() != triangles.size())
        reject("materials", std::to_string(materials.size()) + " numbers",
               "one for each of " + std::to_string(triangles.size()) + " triangles");
    for (const std::uint32_t material : materials) {
        if (material >= transmittances.size())
            reject("materials", std::to_string(material),
                   "indices below the number of transmittances, " + std::to_string(transmittances.size()));
    }
    if (!uvs.empty() && uvs.size() != triangles.size())
        reject("uvs", std::to_string(uvs.size()) + " triangles",
               "one for each of " + std::to_string(triangles.size()) + " triangles");
    for (const auto& corners : uvs)
        for (const Vec2f& uv : corners)
            check_uv(uv);
}

}  // namespace beamspread
