#include "scene/occluders.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "scene/checks.h"
#include "scene/shadow_ray.h"
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
    SetSize size;
    for (const OccluderMesh& mesh : meshes) {
        const std::size_t copies = mesh.placements.size();
        std::size_t mesh_opaque = 0;
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
            mesh_opaque += mesh.transmittance(i) ? 0 : 1;
        size.opaque += copies * mesh_opaque;
        size.see_through += copies * (mesh.triangles.size() - mesh_opaque);
        size.vertices += copies * mesh.vertices.size();
        size.has_uvs |= !mesh.uvs.empty() && mesh_opaque < mesh.triangles.size();
        size.reflects |= !mesh.reflectors.empty();
        size.has_reflector_uvs |= !mesh.reflectors.empty() && !mesh.reflector_uvs.empty();
    }
    return std::make_unique<TriangleSet>(size);
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

unsigned attach_instance(RTCDevice device, RTCScene top, RTCScene part, const Mat3& linear, const Vec3& translation)
{
    const embree::Geometry owner(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
    RTCGeometry geometry = owner.get();
    rtcSetGeometryInstancedScene(geometry, part);
    rtcSetGeometryTimeStepCount(geometry, 1);
    const std::array<Vec3f, 4> columns = {Vec3f(linear[0]), Vec3f(linear[1]), Vec3f(linear[2]), Vec3f(translation)};
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
    rtcCommitGeometry(geometry);
    return rtcAttachGeometry(top, geometry);
}

void set_ray(RTCRay16& packet, std::size_t i, const ShadowRay& ray, const Vec3& origin)
{
    const Vec3f from(ray.origin - origin);
    const Vec3f along(ray.direction);
    packet.org_x[i] = from.x;
    packet.org_y[i] = from.y;
    packet.org_z[i] = from.z;
    packet.dir_x[i] = along.x;
    packet.dir_y[i] = along.y;
    packet.dir_z[i] = along.z;
    packet.tfar[i] = static_cast<float>(ray.distance);
    packet.mask[i] = ~0u;
    packet.id[i] = static_cast<unsigned>(i);
}

// Rays that look for the nearest triangle. Filters of see-through triangles see shadow rays alone.
struct HitPacket {
    HitPacket(std::span<const ShadowRay> all, const Vec3& origin)
    {
        for (std::size_t i = 0; i < all.size(); ++i) {
            set_ray(rays.ray, i, all[i], origin);
            rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
            rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
            valid[i] = -1;
        }
    }

    void trace(RTCScene scene, RTCIntersectContext& context) { rtcIntersect16(valid.data(), scene, &context, &rays); }
    bool is_hit(std::size_t i) const { return rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID; }

    alignas(64) std::array<int, Occluders::packet_size> valid{};
    RTCRayHit16 rays{};
};

// Context that Embree passes to the filter below.
struct CountContext : RTCIntersectContext {
    const TriangleSet* set;  // of triangles outside of instances
    const CountTriangle* counts;
};

void leave_out_others(const RTCFilterFunctionNArguments* hits)
{
    const auto* const context = static_cast<const CountContext*>(hits->context);
    for (unsigned i = 0; i < hits->N; ++i) {
        if (hits->valid[i] != -1)
            continue;
        bool is_counted = RTCHitN_instID(hits->hit, hits->N, i, 0) == RTC_INVALID_GEOMETRY_ID;
        if (is_counted) {
            const std::size_t triangle =
                context->set->index(RTCHitN_geomID(hits->hit, hits->N, i), RTCHitN_primID(hits->hit, hits->N, i));
            is_counted = triangle < context->set->opaque_count() &&
                         (*context->counts)(RTCRayN_id(hits->ray, hits->N, i), triangle);
        }
        hits->valid[i] = is_counted ? -1 : 0;
    }
}

}  // namespace

struct Occluders::Hierarchy {
    const OccluderPart& part(std::size_t index) const
    {
        return *std::ranges::upper_bound(opaque_parts, index, {}, &OccluderPart::end);
    }

    std::vector<OccluderPart> opaque_parts;
    // An instance of a set, by its placement relative to the origin.
    struct Instance {
        const TriangleSet* set;
        Placement placement;
        double rounding;  // metres
    };

    std::vector<std::shared_ptr<const ColorTexture>> transmittances;
    std::vector<std::shared_ptr<const Reflector>> reflectors;
    std::vector<Instance> instances;  // [Embree's number of the geometry]
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
        for (const Placement& placement : copied[i].placements) {
            const std::size_t first = own.opaque_count();
            own.add(meshes[i], placement, m_origin);
            OccluderPart part{own.opaque_count(), placement.owner, glm::determinant(placement.linear) < 0.0,
                              Vec3(std::numeric_limits<double>::infinity()),
                              Vec3(-std::numeric_limits<double>::infinity())};
            for (std::size_t k = first; k < part.end; ++k)
                for (const Vec3& corner : triangle(k)) {
                    part.low = glm::min(part.low, corner);
                    part.high = glm::max(part.high, corner);
                }
            m_hierarchy->opaque_parts.push_back(part);
        }
        if (copied[i].placements.size() < meshes[i].placements.size())
            add_instances(meshes[i]);
        for (std::size_t j = 0; j < meshes[i].triangles.size(); ++j) {
            const ColorTexture* const transmittance = meshes[i].transmittance(j);
            m_is_opaque &= !transmittance || transmittance->is_white();
            m_is_colored |= transmittance && transmittance->is_colored();
        }
        m_hierarchy->transmittances.insert(m_hierarchy->transmittances.end(), meshes[i].transmittances.begin(),
                                           meshes[i].transmittances.end());
        m_hierarchy->reflectors.insert(m_hierarchy->reflectors.end(), meshes[i].reflectors.begin(),
                                       meshes[i].reflectors.end());
    }
    m_is_reflecting =
        std::ranges::any_of(m_hierarchy->reflectors, [](const auto& reflector) { return reflector != nullptr; });
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
        const unsigned id = attach_instance(device, m_hierarchy->top.get(), part, linear, middle - m_origin);
        const Mat3 half_axes(linear[0] * extent.half.x, linear[1] * extent.half.y, linear[2] * extent.half.z);
        const Vec3 reach =
            glm::abs(middle - m_origin) + glm::abs(half_axes[0]) + glm::abs(half_axes[1]) + glm::abs(half_axes[2]);
        m_hulls.push_back({middle, half_axes, std::max({reach.x, reach.y, reach.z}) * condition(linear)});
        m_hierarchy->instances.resize(id + 1);
        m_hierarchy->instances[id] = {&set, {linear, middle - m_origin}, rounding_of(m_hulls.back())};
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

std::span<const OccluderPart> Occluders::opaque_parts() const
{
    return m_hierarchy ? std::span<const OccluderPart>(m_hierarchy->opaque_parts) : std::span<const OccluderPart>();
}

std::uint32_t Occluders::owner(std::size_t index) const
{
    return m_hierarchy->part(index).owner;
}

Vec3 Occluders::normal(std::size_t index) const
{
    const auto [a, b, c] = triangle(index);
    return glm::cross(b - a, c - a) * (m_hierarchy->part(index).is_mirrored ? -1.0 : 1.0);
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

SurfaceHit Occluders::hit_on(unsigned instance, unsigned geometry, unsigned primitive, const Vec2f& barycentric,
                             const Vec3& direction) const
{
    const bool is_own = instance == RTC_INVALID_GEOMETRY_ID;
    const TriangleSet& set = is_own ? *m_hierarchy->sets.front() : *m_hierarchy->instances[instance].set;
    const std::size_t index = set.index(geometry, primitive);
    const auto local = set.corners(index);
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3 corner(local[i]);
        corners[i] = m_origin + (is_own ? corner : m_hierarchy->instances[instance].placement(corner));
    }
    const auto& [a, b, c] = corners;
    SurfaceHit hit;
    hit.normal = glm::cross(b - a, c - a);
    const double area = glm::length(hit.normal);
    if (!(area > 0.0))
        return hit;
    hit.is_hit = true;
    hit.position = a + (b - a) * static_cast<double>(barycentric.x) + (c - a) * static_cast<double>(barycentric.y);
    hit.normal *= (glm::dot(hit.normal, direction) > 0.0 ? -1.0 : 1.0) / area;
    hit.rounding = is_own ? rounding_of(corners, m_origin) : m_hierarchy->instances[instance].rounding;
    if (is_own && index < set.opaque_count())
        hit.own_opaque = index;
    hit.transmittance = set.transmittance_at(index, barycentric);
    hit.reflector = set.reflector(index);
    hit.uv = set.reflector_uv(index, barycentric);
    return hit;
}

void Occluders::find_surfaces(std::span<const ShadowRay> rays, SurfaceHit* hits, bool is_coherent) const
{
    std::fill_n(hits, rays.size(), SurfaceHit{});
    if (!m_hierarchy || rays.empty())
        return;
    HitPacket packet(rays, m_origin);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags =
        m_hulls.empty() && is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    packet.trace(m_hierarchy->top.get(), context);
    const RTCHit16& found = packet.rays.hit;
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (packet.is_hit(i))
            hits[i] = hit_on(found.instID[0][i], found.geomID[i], found.primID[i], {found.u[i], found.v[i]},
                             rays[i].direction);
}

std::uint32_t Occluders::meet(std::span<const ShadowRay> rays, const CountTriangle& counts) const
{
    if (!m_hierarchy || rays.empty())
        return 0;
    HitPacket packet(rays, m_origin);
    CountContext context;
    context.set = m_hierarchy->sets.front().get();
    context.counts = &counts;
    rtcInitIntersectContext(&context);
    context.filter = &leave_out_others;
    packet.trace(m_hierarchy->top.get(), context);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < rays.size(); ++i)
        bits |= static_cast<std::uint32_t>(packet.is_hit(i)) << i;
    return bits;
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
        set_ray(packet, i, rays[i], m_origin);
        valid[i] = -1;
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
