// Triangles that block light.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/vec.h"

namespace beamspread {

// An immutable set of triangles with a bounding volume hierarchy; both sides of a triangle block. Its queries may run on
// any number of threads at once.
class Occluders {
public:
    // `vertices` holds x, y, z of each vertex in world metres, `triangles` three vertex indices each; both are copied.
    // None at all is allowed. Throws InvalidArgument.
    Occluders(std::span<const float> vertices, std::span<const std::uint32_t> triangles);
    ~Occluders();
    Occluders(const Occluders&) = delete;
    Occluders& operator=(const Occluders&) = delete;

    // Whether a triangle lies in (0, distance) on the ray from `origin` along the unit vector `direction`. The distance
    // may be infinite.
    bool blocks(const Vec3& origin, const Vec3& direction, double distance) const;

    std::size_t triangle_count() const { return m_triangle_count; }

    // The largest absolute coordinate of a vertex: what the rounding of hits scales with.
    double reach() const { return m_reach; }

private:
    struct Hierarchy;
    std::unique_ptr<Hierarchy> m_hierarchy;  // null without triangles
    std::size_t m_triangle_count = 0;
    double m_reach = 0.0;
};

// 10000 major + 100 minor + patch of the Embree that is called, which a host's own could have taken the place of.
int embree_version();

}  // namespace beamspread
