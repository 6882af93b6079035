// Rays per CPU second that gathering light traces, beside those of Embree alone: the same rays, made before the clock
// runs.
//
// A floor below a million triangles, lit by an area lamp and by an even sky. Gathering draws the rays, traces them and
// adds up their light. Embree alone tests each ray for an obstacle, one at a time and in packets of 16.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <vector>

#include "base/constants.h"
#include "base/random.h"
#include "base/threads.h"
#include "scene/area_light.h"
#include "scene/triangle_set.h"
#include "scene/environment_light.h"
#include "scene/occluders.h"
#include "scene/ray_gather.h"

using namespace beamspread;

namespace {

constexpr std::size_t side = 512;  // texels
constexpr int rays = 16;           // from each
constexpr int balls = 100;
constexpr int rings = 71;
constexpr std::size_t packet = 16;

struct Shapes {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;
};

void add_ball(const Vec3& centre, double radius, Shapes& shapes)
{
    const auto first = static_cast<std::uint32_t>(shapes.vertices.size());
    for (int row = 0; row <= rings; ++row) {
        for (int column = 0; column < rings; ++column) {
            const double polar = pi * row / rings, turn = 2.0 * pi * column / rings;
            shapes.vertices.push_back(
                centre
                + radius * Vec3(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)));
        }
    }
    const auto vertex = [first](int row, int column) {
        return first + static_cast<std::uint32_t>(row * rings + column % rings);
    };
    for (int row = 0; row < rings; ++row) {
        for (int column = 0; column < rings; ++column) {
            shapes.triangles.push_back({vertex(row, column), vertex(row + 1, column), vertex(row + 1, column + 1)});
            shapes.triangles.push_back({vertex(row, column), vertex(row + 1, column + 1), vertex(row, column + 1)});
        }
    }
}

Shapes standing_balls()
{
    Shapes shapes;
    Random random(1, 0, 0);
    for (int ball = 0; ball < balls; ++ball) {
        const double radius = 0.03 + 0.12 * random.uniform();
        const double x = 3.8 * random.uniform() - 1.9, y = 3.8 * random.uniform() - 1.9;
        add_ball({x, y, radius}, radius, shapes);
    }
    return shapes;
}

class Count final : public RaySink {
public:
    void add(const RayRun& run) override { m_rays += run.count; }
    std::size_t rays() const { return m_rays; }

private:
    std::atomic<std::size_t> m_rays{0};
};

// Seconds of all processor cores together.
double seconds_of(const std::function<void()>& work)
{
    const std::clock_t start = std::clock();
    with_threads(0, work);
    return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

struct Tracer {
    explicit Tracer(const Shapes& shapes)
        : device(rtcNewDevice(nullptr))
        , scene(rtcNewScene(device.get()))
    {
        const embree::Geometry mesh(rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
        auto* const vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
            mesh.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), shapes.vertices.size()));
        for (std::size_t i = 0; i < shapes.vertices.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis)
                vertices[3 * i + static_cast<std::size_t>(axis)] = static_cast<float>(shapes.vertices[i][axis]);
        }
        auto* const triangles = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
            mesh.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), shapes.triangles.size()));
        std::copy(shapes.triangles.begin(), shapes.triangles.end(), triangles);
        rtcCommitGeometry(mesh.get());
        rtcAttachGeometry(scene.get(), mesh.get());
        rtcCommitScene(scene.get());
    }

    embree::Device device;
    embree::Scene scene;
};

// Towards a light from a floor of texels, row by row; rays of a texel one after the other.
std::vector<RTCRay> rays_to(const Light& light, const ReceiverGrid& grid)
{
    Random random(2, 0, 0);
    std::vector<RTCRay> result;
    std::vector<Vec2> square(rays);
    std::vector<Vec3> points(rays);
    std::vector<LightRay> towards(rays);
    for (std::size_t y = 0; y < side; ++y) {
        for (std::size_t x = 0; x < side; ++x) {
            for (Vec2& place : square)
                place = {random.uniform(), random.uniform()};
            const Vec3 point = grid.point(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
            std::ranges::fill(points, point);
            light.sample(points, grid.normal, square, towards.data());
            for (const LightRay& ray : towards) {
                RTCRay packed{};
                packed.org_x = static_cast<float>(point.x);
                packed.org_y = static_cast<float>(point.y);
                packed.org_z = 1e-5f;
                packed.dir_x = static_cast<float>(-ray.travel.x);
                packed.dir_y = static_cast<float>(-ray.travel.y);
                packed.dir_z = static_cast<float>(-ray.travel.z);
                packed.tnear = 0.0f;
                packed.tfar = static_cast<float>(ray.distance);
                packed.mask = ~0u;
                result.push_back(packed);
            }
        }
    }
    return result;
}

double alone(const Tracer& tracer, std::vector<RTCRay> work)
{
    return seconds_of([&] {
        parallel_for(side, [&](std::size_t row) {
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            for (std::size_t i = row * side * rays; i < (row + 1) * side * rays; ++i)
                rtcOccluded1(tracer.scene.get(), &context, &work[i]);
        });
    });
}

double in_packets(const Tracer& tracer, const std::vector<RTCRay>& work)
{
    std::vector<RTCRay16> packets(work.size() / packet);
    for (std::size_t i = 0; i < work.size(); ++i) {
        RTCRay16& into = packets[i / packet];
        const std::size_t lane = i % packet;
        into.org_x[lane] = work[i].org_x, into.org_y[lane] = work[i].org_y, into.org_z[lane] = work[i].org_z;
        into.dir_x[lane] = work[i].dir_x, into.dir_y[lane] = work[i].dir_y, into.dir_z[lane] = work[i].dir_z;
        into.tnear[lane] = work[i].tnear, into.tfar[lane] = work[i].tfar, into.mask[lane] = work[i].mask;
    }
    return seconds_of([&] {
        parallel_for(side, [&](std::size_t row) {
            alignas(64) const std::array<int, packet> valid = {-1, -1, -1, -1, -1, -1, -1, -1,
                                                               -1, -1, -1, -1, -1, -1, -1, -1};
            RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            for (std::size_t i = row * side; i < (row + 1) * side; ++i)
                rtcOccluded16(valid.data(), tracer.scene.get(), &context, &packets[i]);
        });
    });
}

void compare(const char* name, const Light& light, const Shapes& shapes, const Tracer& tracer)
{
    const ReceiverGrid grid{{-2.0, -2.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, 4.0 / side, 4.0 / side,
                            side, side};
    const OccluderMesh mesh{.vertices = shapes.vertices, .triangles = shapes.triangles};
    const Occluders occluders({&mesh, 1}, {}, {});
    const std::unique_ptr<const Light> facing = light.facing(grid.normal);
    const Light& prepared = facing ? *facing : light;
    RaySettings settings;
    settings.rays = rays;
    Count count;
    Progress progress;
    const double gathering = seconds_of([&] { gather_rays(grid, light, &occluders, settings, count, progress); });
    const std::vector<RTCRay> work = rays_to(prepared, grid);
    const auto millions = [](std::size_t number, double seconds) { return 1e-6 * static_cast<double>(number) / seconds; };
    const double traced = millions(work.size(), gathering);
    const double single = millions(work.size(), alone(tracer, work));
    const double together = millions(work.size(), in_packets(tracer, work));
    std::printf("%-10s gathered %.1f million rays per CPU second (%zu of %zu added); Embree alone %.1f, in packets %.1f: "
                "%.0f %%\n",
                name, traced, count.rays(), work.size(), single, together, 100.0 * traced / std::max(single, together));
}

}  // namespace

int main()
{
    const Shapes shapes = standing_balls();
    const Tracer tracer(shapes);
    std::printf("%zu triangles, %zu x %zu texels, %d rays each\n", shapes.triangles.size(), side, side, rays);
    compare("area lamp", AreaLight({0.5, -0.3, 1.8}, Mat3(1.0), 0.5, 0.3, false, pi), shapes, tracer);
    const std::vector<Vec3f> even(8, Vec3f(1.0f));
    compare("even sky", EnvironmentLight(View2D<const Vec3f>{even.data(), 2, 4, 4}, Mat3(1.0)), shapes, tracer);
    return 0;
}
