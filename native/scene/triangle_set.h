// Embree behind one header: handles that release themselves, triangles in one frame in its form, and light that crosses
// see-through triangles. Only occluders.cpp and triangle_set.cpp include it.
#pragma once

#include <embree3/rtcore.h>

#include <array>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "scene/occluder_mesh.h"

namespace beamspread::embree {

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};

using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, Release>;

// Throws std::runtime_error if the device has a pending error.
void check(RTCDevice device);

}  // namespace beamspread::embree

namespace beamspread {

// The part of a ray's light that is left after crossing see-through triangles. Optical depths are added in fixed point, so
// that crossings in any order have the same sum.
class Passage {
public:
    // Counts a crossing; returns false once nothing is left. Two triangles that share an edge both report a ray that meets
    // the edge: crossings `at_edge` at the same distance count once, by the darkest of them.
    bool cross(const Vec3f& transmittance, float distance, bool at_edge);

    int crossings() const { return m_crossings; }
    Vec3f transmittance() const;

private:
    using Depth = std::array<std::int64_t, 3>;

    struct Edge {
        float distance;
        Depth depth;
    };

    Depth* edge_at(float distance);

    Depth m_depth{};
    int m_crossings = 0;
    std::vector<Edge> m_edges;
};

// Context that Embree passes to the filter of see-through triangles; ids of rays are indices of passages.
struct PassageContext : RTCIntersectContext {
    Passage* passages;
    int max_crossings;
};

// Numbers of triangles and vertices that a set holds, and of the parts that only some sets need.
struct SetSize {
    std::size_t opaque = 0;
    std::size_t see_through = 0;
    std::size_t vertices = 0;
    bool has_uvs = false;
    bool reflects = false;
    bool has_reflector_uvs = false;
};

class TriangleSet {
public:
    // Reserves memory.
    explicit TriangleSet(const SetSize& size);
    TriangleSet(const TriangleSet&) = delete;
    TriangleSet& operator=(const TriangleSet&) = delete;

    // Adds a mesh, relative to `origin`, without triangles that let all light through. Throws InvalidArgument.
    void add(const OccluderMesh& mesh, const Placement& placement, const Vec3& origin);

    // Makes the triangles geometries of the scene. The set must outlive the scene.
    void attach(RTCDevice device, RTCScene scene);

    std::size_t size() const { return m_opaque.size() + m_see_through.size(); }
    // Opaque triangles come first.
    std::size_t opaque_count() const { return m_opaque.size(); }
    std::array<Vec3f, 3> corners(std::size_t index) const;

    // Index of a triangle by Embree's numbers.
    std::size_t index(unsigned geometry, unsigned primitive) const
    {
        return (geometry == m_opaque_id ? 0 : m_opaque.size()) + primitive;
    }

    // The part of light that a triangle lets through at a point.
    Vec3f transmittance_at(std::size_t index, const Vec2f& barycentric) const;
    // The reflection of a triangle, null if it is black, and the UV of a point in its image.
    const Reflector* reflector(std::size_t index) const;
    Vec2f reflector_uv(std::size_t index, const Vec2f& barycentric) const;

private:
    struct Reflection {
        std::vector<const Reflector*> reflectors;  // empty if nothing reflects
        std::vector<std::array<Vec2f, 3>> uvs;  // empty without images

        void reserve(std::size_t count, const SetSize& size);
        void add(const OccluderMesh& mesh, std::size_t triangle, const SetSize& size);
    };

    static constexpr unsigned no_geometry = ~0u;

    unsigned attach(RTCDevice device, RTCScene scene, std::vector<Triangle>& triangles, bool is_opaque);
    static void filter(const RTCFilterFunctionNArguments* hits);
    Vec3f transmittance(std::uint32_t see_through, const Vec2f& barycentric) const;

    std::vector<Vec3f> m_vertices;
    std::vector<Triangle> m_opaque;
    std::vector<Triangle> m_see_through;
    std::vector<const ColorTexture*> m_transmittances;  // of see-through triangles
    std::vector<std::array<Vec2f, 3>> m_uvs;  // of see-through triangles; empty without images
    Reflection m_opaque_reflection, m_see_through_reflection;
    SetSize m_reserved;
    unsigned m_opaque_id = no_geometry;  // number in the scene
};

}  // namespace beamspread
