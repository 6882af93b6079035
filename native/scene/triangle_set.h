// Triangles in one frame as Embree keeps them: opaque ones, and those that let light through.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/embree.h"
#include "scene/occluder_mesh.h"
#include "scene/passage.h"

namespace beamspread {

// What Embree hands on to the filter of see-through triangles; the rays' ids are indices of passages.
struct PassageContext : RTCIntersectContext {
    Passage* passages;
    int most_crossings;
};

class TriangleSet {
public:
    // Room for so many triangles and vertices.
    TriangleSet(std::size_t opaque, std::size_t see_through, std::size_t vertices, bool has_uvs);
    TriangleSet(const TriangleSet&) = delete;
    TriangleSet& operator=(const TriangleSet&) = delete;

    // Adds a mesh, relative to `origin`. What lets all light through is left out. Throws InvalidArgument.
    void add(const OccluderMesh& mesh, const Placement& placement, const Vec3& origin);

    // Makes them geometries of the scene, which looks at this set for as long as it lives.
    void attach(RTCDevice device, RTCScene scene);

    std::size_t size() const { return m_opaque.size() + m_see_through.size(); }
    // Opaque ones come first.
    std::size_t opaque_count() const { return m_opaque.size(); }
    std::array<Vec3f, 3> corners(std::size_t index) const;

private:
    void attach(RTCDevice device, RTCScene scene, std::vector<Triangle>& triangles, bool is_opaque);
    static void filter(const RTCFilterFunctionNArguments* hits);
    Vec3f transmittance(std::uint32_t see_through, const Vec2f& barycentric) const;

    std::vector<Vec3f> m_vertices;
    std::vector<Triangle> m_opaque;
    std::vector<Triangle> m_see_through;
    std::vector<const Transmittance*> m_transmittances;  // of the see-through ones, as are the next
    std::vector<std::array<Vec2f, 3>> m_uvs;             // empty if no image is looked up
};

}  // namespace beamspread
