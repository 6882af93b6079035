#include "scene/mesh_light.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>

#include "base/error.h"
#include "scene/checks.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

namespace {

// Fraction of the way to a face that rays are traced, in single precision, so that a face which also blocks light does
// not block its own. From 1 - 2.5e-7 up faces begin to.
constexpr double short_of_face = 1.0 - 1e-5;

// Squared distance over squared size above which a face counts as a point. The error is 2e-3, in inverse proportion.
constexpr double sizes_to_small = 20.0 * 20.0;

// Squared distance over squared size below which a face is sampled by its solid angle. Larger values take time and lower
// noise little: over the face irradiance then hardly changes.
constexpr double near_in_squared_sizes = 4.0;

// Margin of a closed mesh's bounds, in their sizes and in the distance from the origin: points of its own walls lie within,
// where backs are tried, too. Single precision rounds them by 1e-7.
constexpr double bounds_margin = 1e-3;
constexpr double far_margin = 1e-5;

// Part of the rays that choose faces by their power, so that none is left out where it matters, between the points at which
// irradiance is known. More: more rays that bring little.
constexpr double power_share = 0.1;

// Squared size of a face, as a fraction, that is added to its squared distance: beside it irradiance stays finite.
constexpr double near_to_point = 0.25;

}  // namespace

MeshLight::MeshLight(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                     std::span<const Vec3f> radiance, bool is_closed)
    : m_cumulated{0.0}, m_is_closed(is_closed)
{
    for (const Vec3& vertex : vertices) {
        detail::check_finite("vertices", vertex);
        const bool is_first = &vertex == vertices.data();
        m_body_low = is_first ? vertex : glm::min(m_body_low, vertex);
        m_body_high = is_first ? vertex : glm::max(m_body_high, vertex);
    }
    const Vec3 margin =
        bounds_margin * (m_body_high - m_body_low) + far_margin * glm::max(glm::abs(m_body_low), glm::abs(m_body_high));
    m_body_low -= margin;
    m_body_high += margin;
    if (radiance.size() != triangles.size())
        reject("radiance", std::to_string(radiance.size()) + " rows",
               "one for each triangle, " + std::to_string(triangles.size()));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const Vec3 glow(radiance[i]);
        if (!(glow.x >= 0.0 && glow.y >= 0.0 && glow.z >= 0.0) || !detail::is_finite(glow))
            reject("radiance", detail::to_text(glow), "finite values >= 0");
        Face face{.corners = {}, .normal = {}, .squared_size = 0.0, .radiance = glow};
        for (std::size_t k = 0; k < 3; ++k) {
            detail::check_index("triangles", triangles[i][k], "vertices", vertices.size());
            face.corners[k] = vertices[triangles[i][k]];
        }
        const auto& [a, b, c] = face.corners;
        face.squared_size = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
        face.normal = glm::cross(face.corners[1] - face.corners[0], face.corners[2] - face.corners[0]);
        const double power = glm::length(face.normal) * (glow.x + glow.y + glow.z) / 3.0;
        if (!(power > 0.0))
            continue;
        for (const Vec3& corner : face.corners) {
            const bool is_first = m_faces.empty() && &corner == face.corners.data();
            m_low = is_first ? corner : glm::min(m_low, corner);
            m_high = is_first ? corner : glm::max(m_high, corner);
        }
        m_is_colored |= glow.x != glow.y || glow.y != glow.z;
        m_faces.push_back(face);
        m_cumulated.push_back(m_cumulated.back() + power);
    }
}

// Height of the highest corner of a face above the plane at a point.
double MeshLight::height_of(const Face& face, const Vec3& point, const Vec3& normal)
{
    const auto height = [&](std::size_t k) { return glm::dot(normal, face.corners[k] - point); };
    return std::max({height(0), height(1), height(2)});
}

bool MeshLight::shows_fronts_alone(const Vec3& point) const
{
    return m_is_closed && glm::any(glm::lessThan(point, m_body_low) || glm::greaterThan(point, m_body_high));
}

double MeshLight::distance_from(const Vec3& point) const
{
    const double to_glow = glm::distance(point, glm::clamp(point, m_low, m_high));
    if (!m_is_closed)
        return to_glow;
    // At the body's bounds backs begin to count.
    const double to_bounds = glm::distance(point, glm::clamp(point, m_body_low, m_body_high));
    const Vec3 to_sides = glm::min(point - m_body_low, m_body_high - point);
    return std::min(to_glow, std::max(to_bounds, std::min({to_sides.x, to_sides.y, to_sides.z})));
}

std::shared_ptr<MeshLight> MeshLight::without_faces() const
{
    // make_shared can't reach the private constructor.
    std::shared_ptr<MeshLight> light(new MeshLight());
    light->m_low = m_low;
    light->m_high = m_high;
    light->m_body_low = m_body_low;
    light->m_body_high = m_body_high;
    light->m_cumulated = {0.0};
    light->m_is_colored = m_is_colored;
    light->m_is_closed = m_is_closed;
    return light;
}

std::shared_ptr<const Light> MeshLight::facing(const Vec3& normal, std::span<const Vec3> points) const
{
    const std::span corners = points.first(4);
    Vec3 low = corners[0];
    Vec3 high = corners[0];
    for (const Vec3& corner : corners) {
        low = glm::min(low, corner);
        high = glm::max(high, corner);
    }
    // Then no point of the rectangle lies in the bounds.
    const bool has_fronts_alone =
        m_is_closed && glm::any(glm::lessThan(high, m_body_low) || glm::greaterThan(low, m_body_high));
    const auto is_hidden = [&](const Face& face) {
        return std::ranges::all_of(corners, [&](const Vec3& point) {
            return height_of(face, point, normal) <= 0.0 || (has_fronts_alone && shows_back(face, point));
        });
    };
    std::shared_ptr<MeshLight> light = without_faces();
    std::vector<double> brought, power;
    for (std::size_t i = 0; i < m_faces.size(); ++i) {
        const Face& face = m_faces[i];
        if (is_hidden(face))
            continue;
        double irradiance = 0.0;
        for (const Vec3& point : points) {
            const double height = height_of(face, point, normal);
            if (height <= 0.0 || (shows_fronts_alone(point) && shows_back(face, point)))
                continue;
            const Vec3 way = middle(face) - point;
            const double squared = glm::dot(way, way) + near_to_point * face.squared_size;
            irradiance += std::abs(glm::dot(face.normal, way)) * height / (squared * squared);
        }
        light->m_faces.push_back(face);
        brought.push_back(irradiance * (face.radiance.x + face.radiance.y + face.radiance.z));
        power.push_back(m_cumulated[i + 1] - m_cumulated[i]);
    }
    const double all_brought = std::accumulate(brought.begin(), brought.end(), 0.0);
    const double all_power = std::accumulate(power.begin(), power.end(), 0.0);
    for (std::size_t i = 0; i < power.size(); ++i) {
        const double even = power[i] / all_power;
        const double weight = all_brought > 0.0 ? glm::mix(brought[i] / all_brought, even, power_share) : even;
        light->m_cumulated.push_back(light->m_cumulated.back() + weight);
    }
    return light;
}

std::shared_ptr<const Light> MeshLight::facing_all() const
{
    std::shared_ptr<MeshLight> light = without_faces();
    light->m_faces = m_faces;
    std::vector<FaceBox> boxes;
    for (std::size_t i = 0; i < m_faces.size(); ++i) {
        const auto& [a, b, c] = m_faces[i].corners;
        const double power = m_cumulated[i + 1] - m_cumulated[i];
        boxes.push_back({glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c), power});
    }
    light->m_tree = FaceTree(boxes);
    return light;
}

FaceTree::Choice MeshLight::choose(const Vec3& point, const Vec3& normal, double number) const
{
    if (!m_tree.is_empty())
        return m_tree.choose(point, normal, number);
    const double total = m_cumulated.back();
    const double wanted = number * total;
    const auto above = std::upper_bound(m_cumulated.begin() + 1, m_cumulated.end() - 1, wanted);
    const auto index = static_cast<std::size_t>(above - m_cumulated.begin()) - 1;
    const double weight = m_cumulated[index + 1] - m_cumulated[index];
    return {.face = index,
            .probability = weight / total,
            .rest = std::clamp((wanted - m_cumulated[index]) / weight, 0.0, 1.0)};
}

LightRay MeshLight::near_ray(const Vec3& point, const Face& face, const Vec2& place, double probability)
{
    const std::array<Vec3, 3> corners = {face.corners[0] - point, face.corners[1] - point, face.corners[2] - point};
    const SphericalTriangle seen(corners);
    if (!(seen.solid_angle() > 0.0))
        return {.travel = {0.0, 0.0, 1.0}, .distance = 1.0, .flux = Vec3f(0.0f)};
    const Vec3 direction = seen.direction(place);
    const double distance = glm::dot(face.normal, corners[0]) / glm::dot(face.normal, direction);
    // Along the plane of the face rounding decides the distance.
    const double longest = std::sqrt(std::max(
        {glm::dot(corners[0], corners[0]), glm::dot(corners[1], corners[1]), glm::dot(corners[2], corners[2])}));
    if (!(distance > 0.0 && distance <= longest * (1.0 + 1e-6)))
        return {.travel = -direction, .distance = 1.0, .flux = Vec3f(0.0f)};
    return {.travel = -direction,
            .distance = distance * short_of_face,
            .flux = Vec3f(face.radiance * (seen.solid_angle() / probability))};
}

void MeshLight::sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                       LightRay* rays) const
{
    if (m_faces.empty()) {
        std::fill_n(rays, points.size(), LightRay{.travel = -normal, .distance = 1.0, .flux = Vec3f(0.0f)});
        return;
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const FaceTree::Choice chosen = choose(points[i], normal, square[i].x);
        const Face& face = m_faces[chosen.face];
        if (!(chosen.probability > 0.0) || (shows_fronts_alone(points[i]) && shows_back(face, points[i]))) {
            rays[i] = {.travel = -normal, .distance = 1.0, .flux = Vec3f(0.0f)};
            continue;
        }
        const Vec2 place(chosen.rest, square[i].y);
        const Vec3 to_middle = middle(face) - points[i];
        if (!m_tree.is_empty() && glm::dot(to_middle, to_middle) < near_in_squared_sizes * face.squared_size) {
            rays[i] = near_ray(points[i], face, place, chosen.probability);
            continue;
        }
        const double root = std::sqrt(place.x);
        const auto& [a, b, c] = face.corners;
        const Vec3 way = a + root * ((b - a) + place.y * (c - b)) - points[i];
        const double squared = glm::dot(way, way);
        const double distance = std::sqrt(squared);
        // Area times cosine at the light, over the probability of the face.
        const double projected = 0.5 * std::abs(glm::dot(face.normal, way)) / distance / chosen.probability;
        rays[i] = {.travel = -way / distance,
                   .distance = distance * short_of_face,
                   .flux = Vec3f(face.radiance * (projected / squared))};
    }
}

Vec3 MeshLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    Vec3 sum(0.0);
    const bool has_fronts_alone = shows_fronts_alone(point);
    for (const Face& face : m_faces) {
        if (has_fronts_alone && shows_back(face, point))
            continue;
        const auto& [a, b, c] = face.corners;
        const std::array<Vec3, 3> corners = {a - point, b - point, c - point};
        const Vec3 way = (corners[0] + corners[1] + corners[2]) / 3.0;
        const double squared = glm::dot(way, way);
        if (squared > sizes_to_small * face.squared_size) {
            const double cosines = std::abs(glm::dot(face.normal, way)) * std::max(glm::dot(normal, way), 0.0);
            sum += face.radiance * (0.5 * cosines / (squared * squared));
            continue;
        }
        sum += face.radiance * polygon_irradiance(corners, normal);
    }
    return sum;
}

}  // namespace beamspread
