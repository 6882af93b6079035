#include "scene/triangle_set.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Embree's hits are undefined beyond this: products of coordinates overflow single precision.
constexpr double max_coordinate = 1e18;

// Embree's robust test takes a ray for a hit up to a unit in the last place outside of an edge.
constexpr float edge_width = 16.0f * std::numeric_limits<float>::epsilon();

// Embree loads 16 bytes at a time: beyond the last one, as many must be readable.
constexpr std::size_t padding = 1;

}  // namespace

TriangleSet::TriangleSet(std::size_t opaque, std::size_t see_through, std::size_t vertices, bool has_uvs)
{
    m_vertices.reserve(vertices + padding);
    m_opaque.reserve(opaque + padding);
    m_see_through.reserve(see_through + padding);
    m_transmittances.reserve(see_through);
    if (has_uvs)
        m_uvs.reserve(see_through);
}

void TriangleSet::add(const OccluderMesh& mesh, const Placement& placement, const Vec3& origin)
{
    const auto first = static_cast<std::uint32_t>(m_vertices.size());
    for (const Vec3& vertex : mesh.vertices) {
        const Vec3 place = placement(vertex) - origin;
        const Vec3 size = glm::abs(place);
        if (!(size.x < max_coordinate && size.y < max_coordinate && size.z < max_coordinate))
            reject("vertices", detail::to_text(vertex), "finite coordinates within 1e18 m of the origin");
        m_vertices.emplace_back(place);
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto [a, b, c] = mesh.triangles[i];
        const Triangle triangle = {first + a, first + b, first + c};
        const Transmittance* const transmittance = mesh.transmittance(i);
        if (!transmittance) {
            m_opaque.push_back(triangle);
        } else if (!transmittance->is_clear()) {
            m_see_through.push_back(triangle);
            m_transmittances.push_back(transmittance);
            if (m_uvs.capacity() > 0)
                m_uvs.push_back(mesh.uvs.empty() ? std::array<Vec2f, 3>{} : mesh.uvs[i]);
        }
    }
}

void TriangleSet::attach(RTCDevice device, RTCScene scene)
{
    m_vertices.reserve(m_vertices.size() + padding);
    attach(device, scene, m_opaque, true);
    attach(device, scene, m_see_through, false);
}

void TriangleSet::attach(RTCDevice device, RTCScene scene, std::vector<Triangle>& triangles, bool is_opaque)
{
    if (triangles.empty())
        return;
    triangles.reserve(triangles.size() + padding);
    static_assert(sizeof(Vec3f) == 3 * sizeof(float) && sizeof(Triangle) == 3 * sizeof(std::uint32_t));
    const embree::Geometry owner(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    RTCGeometry geometry = owner.get();
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, m_vertices.data(), 0,
                               sizeof(Vec3f), m_vertices.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles.data(), 0,
                               sizeof(Triangle), triangles.size());
    if (!is_opaque) {
        rtcSetGeometryUserData(geometry, this);
        rtcSetGeometryOccludedFilterFunction(geometry, &TriangleSet::filter);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
}

std::array<Vec3f, 3> TriangleSet::corners(std::size_t index) const
{
    const auto [a, b, c] = index < m_opaque.size() ? m_opaque[index] : m_see_through[index - m_opaque.size()];
    return {m_vertices[a], m_vertices[b], m_vertices[c]};
}

Vec3f TriangleSet::transmittance(std::uint32_t see_through, const Vec2f& barycentric) const
{
    Vec2f uv(0.0f);
    if (!m_uvs.empty()) {
        const auto& [a, b, c] = m_uvs[see_through];
        uv = a + (b - a) * barycentric.x + (c - a) * barycentric.y;
    }
    return m_transmittances[see_through]->at(uv);
}

// A hit that is left valid blocks its ray.
void TriangleSet::filter(const RTCFilterFunctionNArguments* hits)
{
    const auto* const set = static_cast<const TriangleSet*>(hits->geometryUserPtr);
    const auto* const context = static_cast<const PassageContext*>(hits->context);
    for (unsigned i = 0; i < hits->N; ++i) {
        if (hits->valid[i] != -1)
            continue;
        const Vec2f barycentric(RTCHitN_u(hits->hit, hits->N, i), RTCHitN_v(hits->hit, hits->N, i));
        const float least = std::min({barycentric.x, barycentric.y, 1.0f - barycentric.x - barycentric.y});
        Passage& passage = context->passages[RTCRayN_id(hits->ray, hits->N, i)];
        const bool is_left = passage.cross(set->transmittance(RTCHitN_primID(hits->hit, hits->N, i), barycentric),
                                           RTCRayN_tfar(hits->ray, hits->N, i), least <= edge_width);
        if (is_left && passage.crossings() <= context->most_crossings)
            hits->valid[i] = 0;
    }
}

}  // namespace beamspread
