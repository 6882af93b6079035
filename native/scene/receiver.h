// The plane that receives light, divided into texels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/vec.h"

namespace beamspread {

// Texel (0, 0) lies at the outer corner `origin`; x runs along a row of texels, y up the plane from row to row. The axes
// are unit vectors at right angles; x, y, normal are left-handed for a mirrored texture.
struct ReceiverGrid {
    Vec3 origin{};  // world, metres
    Vec3 x_axis{};
    Vec3 y_axis{};
    Vec3 normal{};         // toward the lit side
    double pitch_x = 0.0;  // metres per texel
    double pitch_y = 0.0;
    std::size_t width = 0;
    std::size_t height = 0;
    std::uint32_t owner = 0;  // number of the object that the plane belongs to (`Placement::owner`)

    // The step from texel (0, 0) to (x, y) in the world, and the world position there; x and y in texels.
    Vec3 step(double x, double y) const { return x_axis * (x * pitch_x) + y_axis * (y * pitch_y); }
    Vec3 point(double x, double y) const { return origin + step(x, y); }

    // Transforms a world direction to the plane frame.
    Vec3 to_plane(const Vec3& direction) const
    {
        return {glm::dot(direction, x_axis), glm::dot(direction, y_axis), glm::dot(direction, normal)};
    }

    // The largest absolute coordinate relative to `center`: the rounding of such positions is in proportion.
    double reach(const Vec3& center) const;

    // Throws InvalidArgument naming the first field that is out of range.
    void check() const;
};

}  // namespace beamspread
