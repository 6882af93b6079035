// Texels of a mesh that bends: each with a place, a frame and an area of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// A texel lies on one face of the mesh. Its points are position + (u - 1/2) step_x + (v - 1/2) step_y, u and v in [0, 1].
// A texel outside of the mesh has normal 0, and its other values do not count.
struct BentTexel {
    Vec3 position{};  // world, metres: the middle of the part of the mesh that the texel shows
    Vec3f step_x{};   // metres per texel along columns and rows, in the plane of the face; see `BentTexels`
    Vec3f step_y{};
    Vec3f normal{};     // shading normal, unit vector toward the lit side
    Vec3f tangent{};  // unit vector at right angles to the normal; the frame is tangent, cross(normal, tangent), normal
    float area = 0.0f;  // of the part of the mesh that the texel shows, m^2
    Vec3f face{};  // normal of the face, unit vector on the side of the shading normal

    bool is_inside() const { return normal != Vec3f(0.0f); }

    Vec3 point(double u, double v) const { return position + Vec3(step_x) * (u - 0.5) + Vec3(step_y) * (v - 0.5); }

    // The longer side, metres.
    double pitch() const;

    // Transforms a world direction to the frame.
    Vec3 to_tangent(const Vec3& direction) const
    {
        const Vec3 x(tangent);
        const Vec3 z(normal);
        return {glm::dot(direction, x), glm::dot(direction, glm::cross(z, x)), glm::dot(direction, z)};
    }

    // True if cross(normal, tangent) runs against the rows: the texture is mirrored.
    bool is_mirrored() const;
};

// True if texels side by side in the texture are side by side on the mesh, too, and no sharp edge is between them. `step`:
// that of the axis along which they lie, a before b.
bool are_neighbors(const BentTexel& a, const BentTexel& b, Vec3f BentTexel::* step);

// The texels, row by row.
struct BentShape {
    // Computes `face`, makes tangents orthogonal and clears texels outside of the mesh. Throws InvalidArgument naming the
    // first value that is out of range.
    explicit BentShape(std::vector<BentTexel> all);

    std::vector<BentTexel> texels;
    std::size_t inside = 0;  // number of texels inside the mesh
    double area = 0.0;  // of these, m^2
    Vec3 low{0.0};  // box around their corners
    Vec3 high{0.0};
};

}  // namespace beamspread
