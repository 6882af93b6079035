#include "scene/triangle_set.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Units of optical depth that halve light. Fine units keep the depth of few crossings exact in single precision.
constexpr double units_per_half = 1099511627776.0;  // 2^40

// Depth at which light counts as blocked: single precision can't tell 1 - 2^-24 from 1.
constexpr auto max_depth = static_cast<std::int64_t>(24.0 * units_per_half);

// Relative difference of two distances below which they are the same: far above the rounding of single precision.
constexpr float same_distance = 1e-5f;

std::int64_t depth_of(float transmittance)
{
    if (!(transmittance > 0.0f))
        return max_depth;
    const double depth = -std::log2(static_cast<double>(transmittance)) * units_per_half;
    return std::llround(std::clamp(depth, 0.0, static_cast<double>(max_depth)));
}

// Largest coordinate: products of larger ones overflow in Embree.
constexpr double max_coordinate = 1e18;

// Barycentric coordinate below which a hit is at an edge: Embree's robust test accepts rays up to a unit in the last place
// outside.
constexpr float edge_width = 16.0f * std::numeric_limits<float>::epsilon();

// Elements that must be readable after the last one, because Embree loads 16 bytes at a time.
constexpr std::size_t padding = 1;

Vec2f mix(const std::array<Vec2f, 3>& corners, const Vec2f& barycentric)
{
    const auto& [a, b, c] = corners;
    return a + (b - a) * barycentric.x + (c - a) * barycentric.y;
}

}  // namespace

bool Passage::cross(const Vec3f& transmittance, float distance, bool at_edge)
{
    const Depth depth = {depth_of(transmittance.x), depth_of(transmittance.y), depth_of(transmittance.z)};
    Depth* counted = at_edge ? edge_at(distance) : nullptr;
    m_crossings += counted ? 0 : 1;
    bool is_dark = true;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        m_depth[i] += counted ? std::max<std::int64_t>(depth[i] - (*counted)[i], 0) : depth[i];
        if (counted)
            (*counted)[i] = std::max((*counted)[i], depth[i]);
        is_dark &= m_depth[i] >= max_depth;
    }
    if (at_edge && !counted)
        m_edges.push_back({distance, depth});
    return !is_dark;
}

Passage::Depth* Passage::edge_at(float distance)
{
    const auto edge = std::ranges::find_if(m_edges, [distance](const Edge& known) {
        return std::abs(known.distance - distance) <= same_distance * distance;
    });
    return edge == m_edges.end() ? nullptr : &edge->depth;
}

Vec3f Passage::transmittance() const
{
    const auto left = [](std::int64_t depth) {
        return depth >= max_depth ? 0.0f : static_cast<float>(std::exp2(static_cast<double>(-depth) / units_per_half));
    };
    return {left(m_depth[0]), left(m_depth[1]), left(m_depth[2])};
}

TriangleSet::TriangleSet(const SetSize& size) : m_reserved(size)
{
    m_vertices.reserve(size.vertices + padding);
    m_opaque.reserve(size.opaque + padding);
    m_see_through.reserve(size.see_through + padding);
    m_transmittances.reserve(size.see_through);
    if (size.has_uvs)
        m_uvs.reserve(size.see_through);
    m_opaque_reflection.reserve(size.opaque, size);
    m_see_through_reflection.reserve(size.see_through, size);
}

void TriangleSet::Reflection::reserve(std::size_t count, const SetSize& size)
{
    reflectors.reserve(size.reflects ? count : 0);
    uvs.reserve(size.has_reflector_uvs ? count : 0);
}

void TriangleSet::Reflection::add(const OccluderMesh& mesh, std::size_t triangle, const SetSize& size)
{
    if (size.reflects)
        reflectors.push_back(mesh.reflector(triangle));
    if (size.has_reflector_uvs)
        uvs.push_back(mesh.reflector_uvs.empty() ? std::array<Vec2f, 3>{} : mesh.reflector_uvs[triangle]);
}

void TriangleSet::add(const OccluderMesh& mesh, const Placement& placement, const Vec3& origin)
{
    const auto first = static_cast<std::uint32_t>(m_vertices.size());
    for (const Vec3& vertex : mesh.vertices) {
        const Vec3 position = placement(vertex) - origin;
        const Vec3 size = glm::abs(position);
        if (!(size.x < max_coordinate && size.y < max_coordinate && size.z < max_coordinate))
            reject("vertices", detail::to_text(vertex), "finite coordinates within 1e18 m of the origin");
        m_vertices.emplace_back(position);
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto [a, b, c] = mesh.triangles[i];
        const Triangle triangle = {first + a, first + b, first + c};
        const ColorTexture* const transmittance = mesh.transmittance(i);
        if (!transmittance) {
            m_opaque.push_back(triangle);
            m_opaque_reflection.add(mesh, i, m_reserved);
        } else if (!transmittance->is_white()) {
            m_see_through.push_back(triangle);
            m_transmittances.push_back(transmittance);
            if (m_reserved.has_uvs)
                m_uvs.push_back(mesh.uvs.empty() ? std::array<Vec2f, 3>{} : mesh.uvs[i]);
            m_see_through_reflection.add(mesh, i, m_reserved);
        }
    }
}

void TriangleSet::attach(RTCDevice device, RTCScene scene)
{
    m_vertices.reserve(m_vertices.size() + padding);
    m_opaque_id = attach(device, scene, m_opaque, true);
    attach(device, scene, m_see_through, false);
}

unsigned TriangleSet::attach(RTCDevice device, RTCScene scene, std::vector<Triangle>& triangles, bool is_opaque)
{
    if (triangles.empty())
        return no_geometry;
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
    return rtcAttachGeometry(scene, geometry);
}

std::array<Vec3f, 3> TriangleSet::corners(std::size_t index) const
{
    const auto [a, b, c] = index < m_opaque.size() ? m_opaque[index] : m_see_through[index - m_opaque.size()];
    return {m_vertices[a], m_vertices[b], m_vertices[c]};
}

Vec3f TriangleSet::transmittance(std::uint32_t see_through, const Vec2f& barycentric) const
{
    return m_transmittances[see_through]->at(m_uvs.empty() ? Vec2f(0.0f) : mix(m_uvs[see_through], barycentric));
}

Vec3f TriangleSet::transmittance_at(std::size_t index, const Vec2f& barycentric) const
{
    if (index < m_opaque.size())
        return Vec3f(0.0f);
    return transmittance(static_cast<std::uint32_t>(index - m_opaque.size()), barycentric);
}

const Reflector* TriangleSet::reflector(std::size_t index) const
{
    if (!m_reserved.reflects)
        return nullptr;
    return index < m_opaque.size() ? m_opaque_reflection.reflectors[index]
                                   : m_see_through_reflection.reflectors[index - m_opaque.size()];
}

Vec2f TriangleSet::reflector_uv(std::size_t index, const Vec2f& barycentric) const
{
    if (!m_reserved.has_reflector_uvs)
        return Vec2f(0.0f);
    return mix(index < m_opaque.size() ? m_opaque_reflection.uvs[index]
                                       : m_see_through_reflection.uvs[index - m_opaque.size()],
               barycentric);
}

// A hit that stays valid blocks its ray.
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
        if (is_left && passage.crossings() <= context->max_crossings)
            hits->valid[i] = 0;
    }
}

}  // namespace beamspread
