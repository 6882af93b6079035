#include "scene/occluders.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "base/error.h"
#include "scene/checks.h"
#include "scene/embree.h"

namespace beamspread {

namespace embree {

void check(RTCDevice device)
{
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw std::runtime_error("Embree failed with error " + std::to_string(static_cast<int>(error)));
}

}  // namespace embree

namespace {

// Embree's hits are undefined beyond this: products of coordinates overflow single precision.
constexpr double max_coordinate = 1e18;

void check_arguments(std::span<const Vec3> vertices, std::span<const Occluders::Triangle> triangles, const Vec3& origin)
{
    if (!detail::is_finite(origin))
        reject("origin", detail::to_text(origin), "finite coordinates in metres");
    for (const Vec3& vertex : vertices) {
        const Vec3 size = glm::abs(vertex - origin);
        if (!(size.x < max_coordinate && size.y < max_coordinate && size.z < max_coordinate))
            reject("vertices", detail::to_text(vertex), "finite coordinates within 1e18 m of the origin");
    }
    for (const auto& triangle : triangles) {
        for (const std::uint32_t index : triangle) {
            if (index >= vertices.size())
                reject("triangles", std::to_string(index),
                       "indices below the number of vertices, " + std::to_string(vertices.size()));
        }
    }
}

// A new buffer of Embree's, padded as its vector loads need; it lives as long as the geometry.
template <class T>
std::span<T> make_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t count)
{
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), count);
    if (!buffer)
        throw std::bad_alloc();
    return {static_cast<T*>(buffer), count};
}

}  // namespace

struct Occluders::Hierarchy {
    embree::Device device;
    embree::Scene scene;
    std::span<const Vec3f> vertices;  // in buffers of the scene; relative to the origin
    std::span<const Triangle> triangles;
};

Occluders::Occluders(std::span<const Vec3> vertices, std::span<const Triangle> triangles, const Vec3& origin)
    : m_triangle_count(triangles.size()), m_origin(origin)
{
    check_arguments(vertices, triangles, origin);
    if (triangles.empty())
        return;

    m_hierarchy = std::make_unique<Hierarchy>();
    // The user's own .embree3 files must not change what is baked.
    m_hierarchy->device.reset(rtcNewDevice("ignore_config_files=1"));
    RTCDevice device = m_hierarchy->device.get();
    if (!device)
        embree::check(nullptr);
    m_hierarchy->scene.reset(rtcNewScene(device));
    RTCScene scene = m_hierarchy->scene.get();
    // Robust: no light leaks through the shared edges of triangles.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    const embree::Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
    static_assert(sizeof(Vec3f) == 3 * sizeof(float) && sizeof(Triangle) == 3 * sizeof(std::uint32_t));
    const std::span corners =
        make_buffer<Vec3f>(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        corners[i] = Vec3f(vertices[i] - origin);
    }
    const std::span indices =
        make_buffer<Triangle>(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles.size());
    std::ranges::copy(triangles, indices.begin());
    m_hierarchy->vertices = corners;
    m_hierarchy->triangles = indices;
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene, geometry.get());
    rtcCommitScene(scene);
    embree::check(device);
}

Occluders::~Occluders() = default;

std::array<Vec3, 3> Occluders::triangle(std::size_t index) const
{
    const auto corner = [this, index](std::size_t i) {
        return m_origin + Vec3(m_hierarchy->vertices[m_hierarchy->triangles[index][i]]);
    };
    return {corner(0), corner(1), corner(2)};
}

std::uint32_t Occluders::blocked(std::span<const ShadowRay> rays) const
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
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcOccluded16(valid.data(), m_hierarchy->scene.get(), &context, &packet);
    std::uint32_t bits = 0;
    // Embree marks a blocked ray by a negative length.
    for (std::size_t i = 0; i < rays.size(); ++i)
        bits |= static_cast<std::uint32_t>(packet.tfar[i] < 0.0f) << i;
    return bits;
}

void Occluders::transmit(std::span<const ShadowRay> rays, Vec3f* transmittance) const
{
    const std::uint32_t bits = blocked(rays);
    for (std::size_t i = 0; i < rays.size(); ++i)
        transmittance[i] = Vec3f(bits >> i & 1u ? 0.0f : 1.0f);
}

int embree_version()
{
    const embree::Device device(rtcNewDevice("ignore_config_files=1"));
    embree::check(device.get());
    return static_cast<int>(rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_VERSION));
}

}  // namespace beamspread
