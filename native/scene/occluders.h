// Triangles that block light, or let a part of it through.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/occluder_mesh.h"

namespace beamspread {

class Passage;

// Towards a light: what lies in (0, distance) from `origin` along the unit vector `direction` shades `origin`. The
// distance may be infinite; nothing lies within one that is not > 0.
struct ShadowRay {
    Vec3 origin;
    Vec3 direction;
    double distance;
};

// A box that holds an instance of a mesh, in the world.
struct Hull {
    Vec3 centre;
    Mat3 half_axes;  // columns
    double reach;    // what the rounding of the instance's triangles scales with

    // Bit i of `corner`: on which side along the i-th axis.
    Vec3 corner(unsigned corner) const
    {
        const auto side = [corner](unsigned axis) { return corner >> axis & 1u ? 1.0 : -1.0; };
        return centre + half_axes * Vec3(side(0), side(1), side(2));
    }
};

struct OccluderSettings {
    // A ray that has crossed so many see-through triangles ends at the next.
    int most_crossings = std::numeric_limits<int>::max();
    // Where copies of meshes have more triangles than this together, those of one mesh share its triangles.
    std::size_t most_copied = std::size_t{1} << 20;
};

// An immutable set of triangles with a bounding volume hierarchy; both sides of a triangle block. Its queries may run
// on any number of threads at once. Embree works in single precision, here relative to an origin near the receivers, so
// that shadows do not drift where the scene is far from the world's origin. Instances keep the triangles of their mesh
// relative to its own middle, and rays are turned into its frame.
class Occluders {
public:
    // Meshes are copied. None at all is allowed. Throws InvalidArgument.
    Occluders(std::span<const OccluderMesh> meshes, const Vec3& origin, const OccluderSettings& settings);
    ~Occluders();
    Occluders(const Occluders&) = delete;
    Occluders& operator=(const Occluders&) = delete;

    // Rays that are traced together: neighbours take the same way through the hierarchy, and share it.
    static constexpr std::size_t packet_size = 16;

    // What at most `packet_size` rays let through in each channel, 0 to 1. Whether they go much the same way only decides
    // how they are traced.
    void transmit(std::span<const ShadowRay> rays, Vec3f* transmittance, bool is_coherent = true) const;

    // Whether all triangles block all light; else whether some let one channel through more than another.
    bool is_opaque() const { return m_is_opaque; }
    bool is_colored() const { return m_is_colored; }

    // Those of all instances.
    std::size_t triangle_count() const { return m_triangle_count; }

    // Triangles that are no instance's; opaque ones come first.
    std::size_t own_count() const;
    std::size_t own_opaque_count() const;
    // Its corners in the world, rounded as rays meet them.
    std::array<Vec3, 3> triangle(std::size_t index) const;

    std::span<const Hull> hulls() const { return m_hulls; }

    const Vec3& origin() const { return m_origin; }

private:
    struct Hierarchy;
    // Bit i: whether nothing of the i-th ray gets through.
    std::uint32_t trace(std::span<const ShadowRay> rays, Passage* passages, bool is_coherent = true) const;
    void build(std::span<const OccluderMesh> meshes, std::size_t most_copied);
    void add_instances(const OccluderMesh& mesh);

    std::unique_ptr<Hierarchy> m_hierarchy;  // null without triangles
    std::vector<Hull> m_hulls;
    std::size_t m_triangle_count = 0;
    int m_most_crossings;
    bool m_is_opaque = true;
    bool m_is_colored = false;
    Vec3 m_origin;
};

// 10000 major + 100 minor + patch of the Embree that is called, which a host's own could have taken the place of.
int embree_version();

}  // namespace beamspread
