// Triangles that block light.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "base/vec.h"

namespace beamspread {

// Towards a light: what lies in (0, distance) from `origin` along the unit vector `direction` shades `origin`. The
// distance may be infinite; nothing lies within one that is not > 0.
struct ShadowRay {
    Vec3 origin;
    Vec3 direction;
    double distance;
};

// An immutable set of triangles with a bounding volume hierarchy; both sides of a triangle block. Its queries may run
// on any number of threads at once. Embree works in single precision, here relative to an origin near the receivers, so
// that shadows do not drift where the scene is far from the world's origin.
class Occluders {
public:
    // Three indices of vertices.
    using Triangle = std::array<std::uint32_t, 3>;

    // `vertices` are in world metres; both arrays are copied. None at all is allowed. Throws InvalidArgument.
    Occluders(std::span<const Vec3> vertices, std::span<const Triangle> triangles, const Vec3& origin);
    ~Occluders();
    Occluders(const Occluders&) = delete;
    Occluders& operator=(const Occluders&) = delete;

    // Rays that are traced together: neighbours take the same way through the hierarchy, and share it.
    static constexpr std::size_t packet_size = 16;

    // Bit i: whether a triangle blocks the i-th of at most `packet_size` rays.
    std::uint32_t blocked(std::span<const ShadowRay> rays) const;

    // What at most `packet_size` rays let through in each channel, 0 to 1.
    void transmit(std::span<const ShadowRay> rays, Vec3f* transmittance) const;

    std::size_t triangle_count() const { return m_triangle_count; }

    // Its corners in the world, rounded as rays meet them.
    std::array<Vec3, 3> triangle(std::size_t index) const;

    const Vec3& origin() const { return m_origin; }

private:
    struct Hierarchy;
    std::unique_ptr<Hierarchy> m_hierarchy;  // null without triangles
    std::size_t m_triangle_count = 0;
    Vec3 m_origin;
};

// 10000 major + 100 minor + patch of the Embree that is called, which a host's own could have taken the place of.
int embree_version();

}  // namespace beamspread
