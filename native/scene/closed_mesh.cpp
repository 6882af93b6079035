#include "scene/closed_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "base/constants.h"
#include "base/sobol.h"
#include "scene/checks.h"
#include "scene/occluders.h"

namespace beamspread {

namespace {

// Rays from backs, and those that may miss the mesh: at sharp edges they may start outside. More rays find smaller parts
// that are inside out.
constexpr std::size_t back_rays = 4096;
constexpr std::ptrdiff_t most_lost = back_rays / 1024;

// Distance of their starts from the triangle, and their length, in extents of the mesh. Thinner bodies do not count as
// closed; single precision rounds by 1e-7.
constexpr double rounding = 1e-5;
constexpr double far = 4.0;

// The number of the first vertex at the position of each.
std::vector<std::uint32_t> welded(std::span<const Vec3> vertices)
{
    std::vector<std::uint32_t> order(vertices.size());
    std::iota(order.begin(), order.end(), std::uint32_t{0});
    const auto key = [&](std::uint32_t i) { return std::tuple(vertices[i].x, vertices[i].y, vertices[i].z, i); };
    std::ranges::sort(order, {}, key);
    std::vector<std::uint32_t> first(vertices.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
        const bool is_same = k > 0 && vertices[order[k]] == vertices[order[k - 1]];
        first[order[k]] = is_same ? first[order[k - 1]] : order[k];
    }
    return first;
}

bool has_area(const Triangle& triangle)
{
    return triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0];
}

// True if each edge has as many triangles along it as against it.
bool has_no_border(std::span<const Triangle> triangles)
{
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<Edge> along, against;
    for (const Triangle& triangle : triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t begin = triangle[k];
            const std::uint32_t end = triangle[(k + 1) % 3];
            along.emplace_back(begin, end);
            against.emplace_back(end, begin);
        }
    std::ranges::sort(along);
    std::ranges::sort(against);
    return along == against;
}

// True if two triangles have the same corners.
bool has_doubles(std::span<const Triangle> triangles)
{
    std::vector<Triangle> corners(triangles.begin(), triangles.end());
    for (Triangle& triangle : corners)
        std::ranges::sort(triangle);
    std::ranges::sort(corners);
    return std::ranges::adjacent_find(corners) != corners.end();
}

// True if rays from the backs of some of the triangles meet the mesh.
bool hides_backs(std::span<const Vec3> vertices, std::span<const Triangle> triangles, std::span<const Triangle> starts)
{
    Vec3 low = vertices[triangles[0][0]];
    Vec3 high = low;
    for (const Triangle& triangle : triangles)
        for (const std::uint32_t vertex : triangle) {
            low = glm::min(low, vertices[vertex]);
            high = glm::max(high, vertices[vertex]);
        }
    std::vector<double> areas = {0.0};
    for (const Triangle& triangle : starts) {
        const auto& [a, b, c] = std::array{vertices[triangle[0]], vertices[triangle[1]], vertices[triangle[2]]};
        areas.push_back(areas.back() + glm::length(glm::cross(b - a, c - a)));
    }
    const double extent = glm::length(high - low);
    if (!(areas.back() > 0.0))
        return false;
    OccluderMesh mesh;
    mesh.vertices = vertices;
    mesh.triangles = triangles;
    const Occluders occluders({&mesh, 1}, 0.5 * (low + high), {});
    std::vector<Vec2> places(back_rays), sides(back_rays);
    GridSobol(back_rays, 0).points(0, 0, 0, back_rays, places.data(), sides.data());
    std::array<ShadowRay, Occluders::packet_size> rays;
    std::array<Vec3f, Occluders::packet_size> transmittance;
    std::ptrdiff_t lost = 0;
    for (std::size_t first = 0; first < back_rays; first += rays.size()) {
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const Vec2& place = places[first + i];
            const double wanted = place.x * areas.back();
            const auto above = std::upper_bound(areas.begin() + 1, areas.end() - 1, wanted);
            const auto index = static_cast<std::size_t>(above - areas.begin()) - 1;
            const auto& [p, q, r] = starts[index];
            const double part = std::clamp((wanted - areas[index]) / (areas[index + 1] - areas[index]), 0.0, 1.0);
            const double root = std::sqrt(part);
            const Vec3 edge = vertices[q] - vertices[p];
            const Vec3 point = vertices[p] + root * (edge + place.y * (vertices[r] - vertices[q]));
            const Vec3 back = glm::normalize(glm::cross(vertices[r] - vertices[p], edge));
            // Lambert's cosine law: a point of the unit sphere around the tip of the normal.
            const double height = 2.0 * sides[first + i].x - 1.0;
            const double azimuth = 2.0 * pi * sides[first + i].y;
            const double radius = std::sqrt(1.0 - height * height);
            const Vec3 around(radius * std::cos(azimuth), radius * std::sin(azimuth), height);
            rays[i] = {.origin = point + rounding * extent * back,
                       .direction = glm::normalize(back + (1.0 - 1e-9) * around),
                       .distance = far * extent};
        }
        occluders.transmit(rays, transmittance.data(), false);
        lost += std::ranges::count_if(transmittance, [](const Vec3f& light) { return light != Vec3f(0.0f); });
    }
    return lost <= most_lost;
}

}  // namespace

bool is_closed(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
               std::optional<std::span<const std::uint32_t>> glowing)
{
    for (const Vec3& vertex : vertices)
        detail::check_finite("vertices", vertex);
    const std::vector<std::uint32_t> first = welded(vertices);
    std::vector<bool> glows(triangles.size(), !glowing);
    for (const std::uint32_t triangle : glowing.value_or(std::span<const std::uint32_t>{})) {
        detail::check_index("glowing", triangle, "triangles", triangles.size());
        glows[triangle] = true;
    }
    std::vector<Triangle> solid, starts;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        Triangle same;
        for (std::size_t k = 0; k < 3; ++k) {
            detail::check_index("triangles", triangles[i][k], "vertices", vertices.size());
            same[k] = first[triangles[i][k]];
        }
        if (!has_area(same))
            continue;
        solid.push_back(same);
        if (glows[i])
            starts.push_back(same);
    }
    return !solid.empty() && has_no_border(solid) && !has_doubles(solid) && hides_backs(vertices, solid, starts);
}

}  // namespace beamspread
