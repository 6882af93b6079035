#include "scene/occluders.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "scene/checks.h"
#include "scene/triangle_set.h"

namespace beamspread {

namespace embree {

void check(RTCDevice device)
{
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw std::runtime_error("Embree failed with error " + std::to_string(static_cast<int>(error)));
}

}  // namespace embree

namespace {

// Number of triangles of a mesh below which it is copied: an instance takes about 400 bytes, a triangle about 110.
constexpr std::size_t min_instanced = 16;

// Condition of an instance's matrix above which it is copied: rounding of a ray in its frame is in proportion. At 100 rays
// start 16 * 2^-23 * 100 = 2e-4 of the scene's size off the receiver, and closer contact is lost.
constexpr double max_condition = 100.0;

double frobenius(const Mat3& matrix)
{
    return std::sqrt(glm::dot(matrix[0], matrix[0]) + glm::dot(matrix[1], matrix[1]) + glm::dot(matrix[2], matrix[2]));
}

// Condition of a matrix: 1 for a rotation with even scale, infinite or NaN for a singular matrix.
double condition(const Mat3& matrix)
{
    return frobenius(matrix) * frobenius(glm::inverse(matrix)) / 3.0;
}

bool is_shareable(const OccluderMesh& mesh)
{
    return mesh.placements.size() > 1 && mesh.triangles.size() >= min_instanced;
}

bool is_regular(const Placement& placement)
{
    return condition(placement.linear) <= max_condition;
}

// An empty set with memory for these meshes.
std::unique_ptr<TriangleSet> set_for(std::span<const OccluderMesh> meshes)
{
    std::size_t opaque = 0;
    std::size_t see_through = 0;
    std::size_t vertices = 0;
    bool has_uvs = false;
    for (const OccluderMesh& mesh : meshes) {
        const std::size_t copies = mesh.placements.size();
        std::size_t mesh_opaque = 0;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
            mesh_opaque += mesh.transmittance(i) ? 0 : 1;
        opaque += copies * mesh_opaque;
        see_through += copies * (mesh.triangles.size() - mesh_opaque);
        vertices += copies * mesh.vertices.size();
        has_uvs |= !mesh.uvs.empty() && mesh_opaque < mesh.triangles.size();
    }
    return std::make_unique<TriangleSet>(opaque, see_through, vertices, has_uvs);
}

embree::Scene new_scene(RTCDevice device)
{
    embree::Scene scene(rtcNewScene(device));
    // Robust traversal lets no light through the shared edges of triangles.
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    return scene;
}

// The middle of a mesh and half its size, in its own frame.
struct Extent {
    Vec3 middle;
    Vec3 half;

    explicit Extent(std::span<const Vec3> vertices)
    {
        Vec3 low = vertices[0];
        Vec3 high = vertices[0];
        for (const Vec3& vertex : vertices) {
            low = glm::min(low, vertex);
            high = glm::max(high, vertex);
        }
        middle = 0.5 * (low + high);
        half = 0.5 * (high - low);
    }
};

void attach_instance(RTCDevice device, RTCScene top, RTCScene part, const Mat3& linear, const Vec3& translation)
{
    const embree::Geometry owner(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
    RTCGeometry geometry = owner.get();
    rtcSetGeometryInstancedScene(geometry, part);
    rtcSetGeometryTimeStepCount(geometry, 1);
    const std::array<Vec3f, 4> columns = {Vec3f(linear[0]), Vec3f(linear[1]), Vec3f(linear[2]), Vec3f(translation)};
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(top, geometry);
}

}  // namespace

struct Occluders::Hierarchy {
    std::vector<std::shared_ptr<const Transmittance>> transmittances;
    std::vector<std::unique_ptr<TriangleSet>> sets;  // the first holds triangles outside of instances
    embree::Device device;
    std::vector<embree::Scene> parts;  // one for each instanced mesh
    embree::Scene top;
};

Occluders::Occluders(std::span<const OccluderMesh> meshes, const Vec3& origin, const OccluderSettings& settings)
    : m_max_crossings(settings.max_crossings), m_origin(origin)
{
    detail::check_finite("origin", origin);
    for (const OccluderMesh& mesh : meshes) {
        mesh.check();
        m_triangle_count += mesh.placements.size() * mesh.triangles.size();
    }
    if (m_triangle_count > 0)
        build(meshes, settings.max_copied);
}

Occluders::~Occluders() = default;

void Occluders::build(std::span<const OccluderMesh> meshes, std::size_t max_copied)
{
    m_hierarchy = std::make_unique<Hierarchy>();
    // The user's own .embree3 files must not change results.
    m_hierarchy->device.reset(rtcNewDevice("ignore_config_files=1"));
    RTCDevice device = m_hierarchy->device.get();
    if (!device)
        embree::check(nullptr);
    m_hierarchy->top = new_scene(device);

    std::vector<OccluderMesh> copied(meshes.begin(), meshes.end());
    if (m_triangle_count > max_copied) {
        for (OccluderMesh& mesh : copied)
            if (is_shareable(mesh))
                std::erase_if(mesh.placements, is_regular);
    }
    m_hierarchy->sets.push_back(set_for(copied));
    TriangleSet& own = *m_hierarchy->sets.front();
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        for (const Placement& placement : copied[i].placements)
            own.add(meshes[i], placement, m_origin);
        if (copied[i].placements.size() < meshes[i].placements.size())
            add_instances(meshes[i]);
        for (std::size_t j = 0; j < meshes[i].triangles.size(); ++j) {
            const Transmittance* const transmittance = meshes[i].transmittance(j);
            m_is_opaque &= !transmittance || transmittance->is_clear();
            m_is_colored |= transmittance && transmittance->is_colored();
        }
        m_hierarchy->transmittances.insert(m_hierarchy->transmittances.end(), meshes[i].transmittances.begin(),
                                           meshes[i].transmittances.end());
    }
    own.attach(device, m_hierarchy->top.get());
    rtcCommitScene(m_hierarchy->top.get());
    embree::check(device);
}

void Occluders::add_instances(const OccluderMesh& mesh)
{
    RTCDevice device = m_hierarchy->device.get();
    const Extent extent(mesh.vertices);
    OccluderMesh alone = mesh;
    alone.placements = {Placement{}};
    m_hierarchy->sets.push_back(set_for({&alone, 1}));
    TriangleSet& set = *m_hierarchy->sets.back();
    set.add(alone, {}, extent.middle);
    RTCScene part = m_hierarchy->parts.emplace_back(new_scene(device)).get();
    set.attach(device, part);
    rtcCommitScene(part);
    for (const Placement& placement : mesh.placements) {
        if (!is_regular(placement))
            continue;
        const Mat3& linear = placement.linear;
        const Vec3 middle = placement(extent.middle);
        attach_instance(device, m_hierarchy->top.get(), part, linear, middle - m_origin);
        const Mat3 half_axes(linear[0] * extent.half.x, linear[1] * extent.half.y, linear[2] * extent.half.z);
        const Vec3 reach =
            glm::abs(middle - m_origin) + glm::abs(half_axes[0]) + glm::abs(half_axes[1]) + glm::abs(half_axes[2]);
        m_hulls.push_back({middle, half_axes, std::max({reach.x, reach.y, reach.z}) * condition(linear)});
    }
}

std::size_t Occluders::own_count() const
{
    return m_hierarchy ? m_hierarchy->sets.front()->size() : 0;
}

std::size_t Occluders::own_opaque_count() const
{
    return m_hierarchy ? m_hierarchy->sets.front()->opaque_count() : 0;
}

std::array<Vec3, 3> Occluders::triangle(std::size_t index) const
{
    const auto [a, b, c] = m_hierarchy->sets.front()->corners(index);
    return {m_origin + Vec3(a), m_origin + Vec3(b), m_origin + Vec3(c)};
}

void Occluders::transmit(std::span<const ShadowRay> rays, Vec3f* transmittance, bool is_coherent) const
{
    if (m_is_opaque) {
        const std::uint32_t bits = trace(rays, nullptr, is_coherent);
        for (std::size_t i = 0; i < rays.size(); ++i)
            transmittance[i] = Vec3f(bits >> i & 1u ? 0.0f : 1.0f);
        return;
    }
    std::array<Passage, packet_size> passages;
    const std::uint32_t bits = trace(rays, passages.data());
    for (std::size_t i = 0; i < rays.size(); ++i)
        transmittance[i] = bits >> i & 1u ? Vec3f(0.0f) : passages[i].transmittance();
}

std::uint32_t Occluders::trace(std::span<const ShadowRay> rays, Passage* passages, bool is_coherent) const
{
    if (!m_hierarchy || rays.empty())
        return 0;
    alignas(64) std::array<int, packet_size> valid{};  // -1: a ray
    RTCRay16 packet{};
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!(rays[i].distance > 0.0))
            continue;
        const Vec3f from(rays[i].origin - m_origin);
        const Vec3f along(rays[i].direction);
        valid[i] = -1;
        packet.org_x[i] = from.x;
        packet.org_y[i] = from.y;
        packet.org_z[i] = from.z;
        packet.dir_x[i] = along.x;
        packet.dir_y[i] = along.y;
        packet.dir_z[i] = along.z;
        packet.tfar[i] = static_cast<float>(rays[i].distance);
        packet.mask[i] = ~0u;
        packet.id[i] = static_cast<unsigned>(i);
    }
    PassageContext context;
    context.passages = passages;
    context.max_crossings = m_max_crossings;
    rtcInitIntersectContext(&context);
    // Embree may test coherent rays against one triangle several times, which filters would count, and without end in
    // instances.
    const bool is_plain = !passages && m_hulls.empty();
    context.flags =
        is_plain && is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcOccluded16(valid.data(), m_hierarchy->top.get(), &context, &packet);
    std::uint32_t bits = 0;
    // Embree marks a blocked ray by a negative length.
    for (std::size_t i = 0; i < rays.size(); ++i)
        bits |= static_cast<std::uint32_t>(packet.tfar[i] < 0.0f) << i;
    return bits;
}

}  // namespace beamspread
