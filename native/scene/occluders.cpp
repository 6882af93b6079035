#include "scene/occluders.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "base/error.h"
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
constexpr float max_coordinate = 1e18f;

void check_arrays(std::span<const float> vertices, std::span<const std::uint32_t> triangles)
{
    if (vertices.size() % 3 != 0)
        reject("vertices", std::to_string(vertices.size()) + " numbers", "three per vertex");
    if (triangles.size() % 3 != 0)
        reject("triangles", std::to_string(triangles.size()) + " indices", "three per triangle");
    for (const float coordinate : vertices) {
        if (!(std::abs(coordinate) < max_coordinate))
            reject("vertices", static_cast<double>(coordinate), "finite coordinates below 1e18 m");
    }
    const std::size_t count = vertices.size() / 3;
    for (const std::uint32_t index : triangles) {
        if (index >= count)
            reject("triangles", std::to_string(index),
                   "indices below the number of vertices, " + std::to_string(count));
    }
}

// Copies `values` into a new buffer of Embree's, which pads it as its vector loads need; it lives as long as the
// geometry.
template <class T>
const T* set_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::span<const T> values)
{
    void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, 3 * sizeof(T), values.size() / 3);
    if (!buffer)
        throw std::bad_alloc();
    std::copy(values.begin(), values.end(), static_cast<T*>(buffer));
    return static_cast<const T*>(buffer);
}

}  // namespace

struct Occluders::Hierarchy {
    embree::Device device;
    embree::Scene scene;
    const float* vertices = nullptr;  // in buffers of the scene
    const std::uint32_t* triangles = nullptr;
};

Occluders::Occluders(std::span<const float> vertices, std::span<const std::uint32_t> triangles)
    : m_triangle_count(triangles.size() / 3)
{
    check_arrays(vertices, triangles);
    for (const float coordinate : vertices)
        m_reach = std::max(m_reach, static_cast<double>(std::abs(coordinate)));
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
    m_hierarchy->vertices = set_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices);
    m_hierarchy->triangles = set_buffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles);
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene, geometry.get());
    rtcCommitScene(scene);
    embree::check(device);
}

Occluders::~Occluders() = default;

std::array<Vec3, 3> Occluders::triangle(std::size_t index) const
{
    const auto corner = [this, index](std::size_t i) {
        const float* vertex = m_hierarchy->vertices + std::size_t{3} * m_hierarchy->triangles[3 * index + i];
        return Vec3(vertex[0], vertex[1], vertex[2]);
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
        const Vec3f from(rays[i].origin);
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

int embree_version()
{
    const embree::Device device(rtcNewDevice("ignore_config_files=1"));
    embree::check(device.get());
    return static_cast<int>(rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_VERSION));
}

}  // namespace beamspread
