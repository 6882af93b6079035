// Triangles of other objects that lie on a receiver, nearer than shadow rays start.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

struct RayStart;

// True if an opaque triangle outside of instances lies on the plane, within the height where rays start, and blocks its
// light. A triangle of the receiver's own object never does. One that faces the plane does, also at no distance: the
// floor under a box. One that faces the same way has to lie above the plane by more than rounding, since a decal and
// the floor below it may share a plane.
bool is_contact(const ReceiverGrid& grid, const Occluders& occluders, std::size_t triangle, const RayStart& start);

// For each texel of a mesh that bends 1 if such a triangle lies on its middle, above its face and nearer to it than rays
// start; empty if none does.
std::vector<std::uint8_t> covered_texels(const ReceiverGrid& grid, const Occluders& occluders, const RayStart& start);

// All such triangles of a plane.
class Contacts {
public:
    // `occluders` may be null.
    Contacts(const ReceiverGrid& grid, const Occluders* occluders, const RayStart& start);

    // True if one of them covers a point of the plane.
    bool cover(const Vec3& point) const { return !m_texels.empty() && cover_in_texel(point); }

private:
    enum class Cover : std::uint8_t { none, part, whole };

    // Sides of a triangle in texels: a x + b y + c >= 0 inside.
    using Sides = std::array<Vec3, 3>;

    struct Part {
        std::size_t texel;
        Sides sides;
    };

    void add(const std::array<Vec3, 3>& triangle);
    bool cover_in_texel(const Vec3& point) const;
    Vec2 in_texels(const Vec3& point) const;

    const ReceiverGrid& m_grid;
    std::vector<Cover> m_texels;  // empty if there are no such triangles
    std::vector<Part> m_parts;    // sorted by texel: triangles that cover a part of it
};

}  // namespace beamspread
