// Triangles that block light, or let a part of it through.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/occluder_mesh.h"

namespace beamspread {

class Passage;
class Reflector;

// A ray toward a light: triangles at (0, distance) from `origin` along the unit vector `direction` shade `origin`. The
// distance may be infinite; a ray whose distance is not > 0 meets nothing.
struct ShadowRay {
    Vec3 origin;
    Vec3 direction;
    double distance;
};

// The nearest point of a surface on a ray.
struct SurfaceHit {
    bool is_hit = false;
    Vec3 position;  // world, on the triangle
    Vec3 normal;    // unit vector on the side that the ray comes from
    double rounding = 0.0;  // metres; rays that start nearer may meet the triangle itself
    // Index of an opaque triangle outside of instances; of others the object is not known.
    std::optional<std::size_t> own_opaque{};
    Vec3f transmittance;
    const Reflector* reflector = nullptr;  // null: black
    Vec2f uv;  // in the image of the reflector
};

// A box that holds an instance of a mesh, in the world.
struct Hull {
    Vec3 centre;
    Mat3 half_axes;  // columns
    double reach;    // metres; the rounding of the instance's triangles is in proportion

    // Bit i of `corner` chooses the side along the i-th axis.
    Vec3 corner(unsigned corner) const
    {
        const auto side = [corner](unsigned axis) { return corner >> axis & 1u ? 1.0 : -1.0; };
        return centre + half_axes * Vec3(side(0), side(1), side(2));
    }
};

// Opaque triangles outside of instances, before `end` and from that of the part before on: those of one mesh in one place.
struct OccluderPart {
    std::size_t end;
    std::uint32_t owner;
    bool is_mirrored;  // true if the placement is
    Vec3 low;          // box around them, world; nothing if there are none
    Vec3 high;
};

struct OccluderSettings {
    // Number of see-through triangles that a ray crosses; it ends at the next.
    int max_crossings = std::numeric_limits<int>::max();
    // Number of triangles, with those of copies, above which the placements of a mesh share its triangles. More take
    // memory and trace faster.
    std::size_t max_copied = std::size_t{1} << 20;
};

// True if a triangle that a ray meets counts for it; the triangle is opaque and outside of instances.
using CountTriangle = std::function<bool(std::size_t ray, std::size_t triangle)>;

// An immutable set of triangles with a bounding volume hierarchy; both sides of a triangle block. Its queries may run
// on any number of threads at once. Embree works in single precision, here relative to an origin near the receivers, so
// that shadows do not drift where the scene is far from the world's origin. Instances keep the triangles of their mesh
// relative to its own middle, and rays are turned into its frame.
class Occluders {
public:
    // Copies the meshes; there may be none. Throws InvalidArgument.
    Occluders(std::span<const OccluderMesh> meshes, const Vec3& origin, const OccluderSettings& settings);
    ~Occluders();
    Occluders(const Occluders&) = delete;
    Occluders& operator=(const Occluders&) = delete;

    // Number of rays that are traced together: neighbors share their way through the hierarchy.
    static constexpr std::size_t packet_size = 16;

    // Finds the part of light, 0 to 1 in each channel, that reaches the origins of at most `packet_size` rays.
    // `is_coherent` says that they run much the same way; it only changes the speed.
    void transmit(std::span<const ShadowRay> rays, Vec3f* transmittance, bool is_coherent = true) const;

    // Finds the nearest surface along at most `packet_size` rays.
    void find_surfaces(std::span<const ShadowRay> rays, SurfaceHit* hits, bool is_coherent) const;

    // Returns bits: bit i is set if the i-th of at most `packet_size` rays meets a triangle that counts, which must not
    // throw.
    std::uint32_t meet(std::span<const ShadowRay> rays, const CountTriangle& counts) const;

    // Number of see-through triangles that a ray crosses; it ends at the next.
    int max_crossings() const { return m_max_crossings; }

    // True if some triangles reflect light.
    bool is_reflecting() const { return m_is_reflecting; }

    // True if all triangles block all light.
    bool is_opaque() const { return m_is_opaque; }
    // True if some triangles let one channel through more than another.
    bool is_colored() const { return m_is_colored; }

    // Number of triangles; those of each instance count.
    std::size_t triangle_count() const { return m_triangle_count; }

    // Number of triangles outside of instances; opaque ones come first.
    std::size_t own_count() const;
    std::size_t own_opaque_count() const;
    // World corners of such a triangle, rounded as rays meet them.
    std::array<Vec3, 3> triangle(std::size_t index) const;
    std::span<const OccluderPart> opaque_parts() const;
    // Number of the object that such an opaque triangle belongs to, and a vector along the normal of its front.
    std::uint32_t owner(std::size_t index) const;
    Vec3 normal(std::size_t index) const;

    std::span<const Hull> hulls() const { return m_hulls; }

    const Vec3& origin() const { return m_origin; }

private:
    struct Hierarchy;
    // Returns bits: bit i is set if nothing of the i-th ray gets through.
    std::uint32_t trace(std::span<const ShadowRay> rays, Passage* passages, bool is_coherent = true) const;
    void build(std::span<const OccluderMesh> meshes, std::size_t max_copied);
    void add_instances(const OccluderMesh& mesh);
    SurfaceHit hit_on(unsigned instance, unsigned geometry, unsigned primitive, const Vec2f& barycentric,
                      const Vec3& direction) const;

    std::unique_ptr<Hierarchy> m_hierarchy;  // null without triangles
    std::vector<Hull> m_hulls;
    std::size_t m_triangle_count = 0;
    int m_max_crossings;
    bool m_is_opaque = true;
    bool m_is_colored = false;
    bool m_is_reflecting = false;
    Vec3 m_origin;
};

}  // namespace beamspread
