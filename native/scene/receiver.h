// The surface that receives light, divided into texels.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/vec.h"
#include "scene/bent_shape.h"

namespace beamspread {

// A plane, or a mesh that bends. On a plane texel (0, 0) lies at the outer corner `origin`; x runs along a row of texels, y
// up the plane from row to row. The axes are unit vectors at right angles; x, y, normal are left-handed for a mirrored
// texture. Where the mesh bends, `shape` has the texels: neighbors of the texture are mostly neighbors on the mesh, but not
// across the borders of its islands.
struct ReceiverGrid {
    Vec3 origin{};  // world, metres
    Vec3 x_axis{};
    Vec3 y_axis{};
    Vec3 normal{};         // toward the lit side
    double pitch_x = 0.0;  // metres per texel; where the mesh bends the root of the mean area
    double pitch_y = 0.0;
    std::size_t width = 0;
    std::size_t height = 0;
    std::uint32_t owner = 0;  // number of the object that the surface belongs to (`Placement::owner`)
    std::shared_ptr<const BentShape> shape{};  // null: a plane, which the axes tell

    // A grid of texels that bend. Throws InvalidArgument naming the first value that is out of range.
    static ReceiverGrid bent(std::vector<BentTexel> texels, std::size_t width, std::size_t height, std::uint32_t owner);

    bool is_bent() const { return shape != nullptr; }
    std::size_t texels() const { return width * height; }

    // Number of texels that light can reach: those inside the mesh where it bends, all on a plane.
    std::size_t receiving() const { return is_bent() ? shape->inside : texels(); }

    // A texel where the mesh bends.
    const BentTexel& bent_texel(std::size_t texel) const { return shape->texels[texel]; }

    // The texel that a position in texels lies in.
    std::size_t texel_at(double x, double y) const
    {
        return std::min(static_cast<std::size_t>(y), height - 1) * width +
               std::min(static_cast<std::size_t>(x), width - 1);
    }

    // The step on a plane from texel (0, 0) to (x, y) in the world; x and y in texels.
    Vec3 step(double x, double y) const { return x_axis * (x * pitch_x) + y_axis * (y * pitch_y); }

    // The world position at x and y in texels.
    Vec3 point(double x, double y) const { return is_bent() ? bent_point(x, y) : origin + step(x, y); }

    // Some points evenly on a plane, its four corners first.
    std::vector<Vec3> points() const;

    // The shading normal of a texel; 0 outside of a mesh that bends.
    Vec3 normal_at(std::size_t texel) const { return is_bent() ? Vec3(bent_texel(texel).normal) : normal; }

    // Transforms a world direction to the plane frame.
    Vec3 to_plane(const Vec3& direction) const
    {
        return {glm::dot(direction, x_axis), glm::dot(direction, y_axis), glm::dot(direction, normal)};
    }

    // Transforms a world direction to the tangent frame of a texel.
    Vec3 to_tangent(std::size_t texel, const Vec3& direction) const
    {
        return is_bent() ? bent_texel(texel).to_tangent(direction) : to_plane(direction);
    }

    // The longer side of a texel, metres.
    double pitch_at(std::size_t texel) const
    {
        return is_bent() ? bent_texel(texel).pitch() : std::max(pitch_x, pitch_y);
    }

    // The largest absolute coordinate relative to `center`: the rounding of such positions is in proportion.
    double reach(const Vec3& center) const;

    // Throws InvalidArgument naming the first field that is out of range.
    void check() const;

private:
    Vec3 bent_point(double x, double y) const;
};

}  // namespace beamspread
