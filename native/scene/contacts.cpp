#include "scene/contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/threads.h"
#include "scene/shadow_ray.h"

namespace beamspread {

namespace {

// Error of a corner's height, in halves of a unit in the last place of its coordinates along the normal: two meshes and
// two matrices in single precision. Larger: decals have to lie higher above their floor to shade it.
constexpr double height_error = 4.0;

constexpr double half_ulp = 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon());

double height_rounding(const Vec3& corner, const Vec3& origin, const Vec3& normal)
{
    return height_error * half_ulp * glm::dot(glm::abs(normal), glm::abs(corner - origin));
}

double height_rounding(const std::array<Vec3, 3>& triangle, const Vec3& origin, const Vec3& normal)
{
    return std::max({height_rounding(triangle[0], origin, normal), height_rounding(triangle[1], origin, normal),
                     height_rounding(triangle[2], origin, normal)});
}

// True if a triangle with this normal at a height above a surface, which is lower than rays start, blocks light. The error
// of the height is known.
bool blocks(const Vec3& triangle, const Vec3& surface, double height, double rounding, const RayStart& start)
{
    return glm::dot(triangle, surface) < 0.0 ? height >= -rounding : height > start.clearance + rounding;
}

// A box along the axes of the world; empty at first.
struct Box {
    Vec3 low{std::numeric_limits<double>::infinity()};
    Vec3 high{-std::numeric_limits<double>::infinity()};

    void include(const Vec3& point)
    {
        low = glm::min(low, point);
        high = glm::max(high, point);
    }

    bool contains(const Vec3& point) const
    {
        return glm::all(glm::greaterThanEqual(point, low)) && glm::all(glm::lessThanEqual(point, high));
    }
};

// A box around the places of a mesh to which triangles of other objects may be nearer than rays start, and the largest
// error of the heights of these triangles.
struct Others {
    Box box;
    double rounding = 0.0;
};

Others others_near(const ReceiverGrid& grid, const Occluders& occluders, const RayStart& start)
{
    double away = 0.0;
    for (const BentTexel& texel : grid.shape->texels)
        if (texel.is_inside())
            away = std::max(away, height_of_rays(start, texel));
    const Vec3 low = grid.shape->low - away;
    const Vec3 high = grid.shape->high + away;
    const auto meets = [&](const Vec3& other_low, const Vec3& other_high) {
        return glm::all(glm::lessThanEqual(other_low, high)) && glm::all(glm::greaterThanEqual(other_high, low));
    };
    Others near;
    std::size_t first = 0;
    for (const OccluderPart& part : occluders.opaque_parts()) {
        const bool is_near = part.owner != grid.owner && meets(part.low, part.high);
        for (std::size_t i = std::exchange(first, part.end); i < part.end && is_near; ++i) {
            const std::array<Vec3, 3> triangle = occluders.triangle(i);
            Box box;
            for (const Vec3& corner : triangle)
                box.include(corner);
            if (!meets(box.low, box.high))
                continue;
            near.box.include(glm::max(box.low - away, grid.shape->low));
            near.box.include(glm::min(box.high + away, grid.shape->high));
            near.rounding = std::max(near.rounding, height_rounding(triangle, occluders.origin(), Vec3(1.0)));
        }
    }
    return near;
}

}  // namespace

bool is_contact(const ReceiverGrid& grid, const Occluders& occluders, std::size_t triangle, const RayStart& start)
{
    if (occluders.owner(triangle) == grid.owner)
        return false;
    const std::array<Vec3, 3> corners = occluders.triangle(triangle);
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3& corner : corners) {
        const double height = glm::dot(corner - grid.origin, grid.normal);
        if (height > start.height())
            return false;
        lowest = std::min(lowest, height);
    }
    const double rounding = height_rounding(corners, occluders.origin(), grid.normal);
    return blocks(occluders.normal(triangle), grid.normal, lowest, rounding, start);
}

std::vector<std::uint8_t> covered_texels(const ReceiverGrid& grid, const Occluders& occluders, const RayStart& start)
{
    const std::span<const BentTexel> texels = grid.shape->texels;
    const Others near = others_near(grid, occluders, start);
    std::vector<std::size_t> candidates;
    for (std::size_t i = 0; i < texels.size(); ++i)
        if (texels[i].is_inside() && near.box.contains(texels[i].position))
            candidates.push_back(i);
    std::vector<std::uint8_t> covered(candidates.empty() ? 0 : texels.size());
    const std::size_t packets = (candidates.size() + Occluders::packet_size - 1) / Occluders::packet_size;
    parallel_for(packets, [&](std::size_t packet) {
        const std::size_t first = packet * Occluders::packet_size;
        const std::span part =
            std::span(candidates).subspan(first, std::min(candidates.size() - first, Occluders::packet_size));
        // Each ray runs from where light rays start down to the face. It is longer at both ends by the error of heights.
        std::array<ShadowRay, Occluders::packet_size> rays;
        for (std::size_t k = 0; k < part.size(); ++k) {
            const BentTexel& texel = texels[part[k]];
            const Vec3 face(texel.face);
            const double height = height_of_rays(start, texel) + near.rounding;
            rays[k] = {texel.position + face * height, -face, height + near.rounding};
        }
        const auto counts = [&](std::size_t k, std::size_t triangle) {
            if (occluders.owner(triangle) == grid.owner)
                return false;
            const BentTexel& texel = texels[part[k]];
            const Vec3 face(texel.face);
            const std::array<Vec3, 3> corners = occluders.triangle(triangle);
            const Vec3 normal = occluders.normal(triangle);
            // In double precision: the distance along the ray has errors in proportion to the size of the triangle.
            const double height = glm::dot(corners[0] - texel.position, normal) / glm::dot(face, normal);
            const double rounding = height_rounding(corners, occluders.origin(), face);
            return height <= height_of_rays(start, texel) && blocks(normal, face, height, rounding, start);
        };
        const std::uint32_t bits = occluders.meet(std::span(rays).first(part.size()), counts);
        for (std::size_t k = 0; k < part.size(); ++k)
            covered[part[k]] = bits >> k & 1u;
    });
    return covered;
}

Contacts::Contacts(const ReceiverGrid& grid, const Occluders* occluders, const RayStart& start) : m_grid(grid)
{
    for (std::size_t i = 0; occluders && i < occluders->own_opaque_count(); ++i)
        if (is_contact(grid, *occluders, i, start))
            add(occluders->triangle(i));
    std::ranges::stable_sort(m_parts, {}, &Part::texel);
}

Vec2 Contacts::in_texels(const Vec3& point) const
{
    const Vec3 offset = point - m_grid.origin;
    return {glm::dot(offset, m_grid.x_axis) / m_grid.pitch_x, glm::dot(offset, m_grid.y_axis) / m_grid.pitch_y};
}

void Contacts::add(const std::array<Vec3, 3>& triangle)
{
    const std::array<Vec2, 3> corners = {in_texels(triangle[0]), in_texels(triangle[1]), in_texels(triangle[2])};
    Sides sides;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec2& a = corners[i];
        const Vec2& b = corners[(i + 1) % 3];
        sides[i] = {a.y - b.y, b.x - a.x, a.x * b.y - a.y * b.x};
        const Vec2& inside = corners[(i + 2) % 3];
        if (glm::dot(sides[i], Vec3(inside, 1.0)) < 0.0)
            sides[i] = -sides[i];
    }
    const Vec2 low = glm::min(glm::min(corners[0], corners[1]), corners[2]);
    const Vec2 high = glm::max(glm::max(corners[0], corners[1]), corners[2]);
    const auto clamped = [](double texel, std::size_t count) {
        return static_cast<std::size_t>(std::clamp(texel, 0.0, static_cast<double>(count)));
    };
    const std::size_t end_x = clamped(std::ceil(high.x), m_grid.width);
    const std::size_t end_y = clamped(std::ceil(high.y), m_grid.height);
    for (std::size_t y = clamped(std::floor(low.y), m_grid.height); y < end_y; ++y)
        for (std::size_t x = clamped(std::floor(low.x), m_grid.width); x < end_x; ++x) {
            const Vec3 middle(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5, 1.0);
            bool is_whole = true;
            bool is_outside = false;
            for (const Vec3& side : sides) {
                const double at_middle = glm::dot(side, middle);
                const double change = 0.5 * (std::abs(side.x) + std::abs(side.y));  // up to a corner of the texel
                is_whole &= at_middle >= change;
                is_outside |= at_middle <= -change;
            }
            if (is_outside)
                continue;
            m_texels.resize(m_grid.width * m_grid.height, Cover::none);
            const std::size_t texel = y * m_grid.width + x;
            m_texels[texel] = std::max(m_texels[texel], is_whole ? Cover::whole : Cover::part);
            if (!is_whole)
                m_parts.push_back({texel, sides});
        }
}

bool Contacts::cover_in_texel(const Vec3& point) const
{
    const Vec2 position = in_texels(point);
    const auto index = [](double texel, std::size_t count) {
        return static_cast<std::size_t>(std::clamp(texel, 0.0, static_cast<double>(count) - 1.0));
    };
    const std::size_t texel = index(position.y, m_grid.height) * m_grid.width + index(position.x, m_grid.width);
    if (m_texels[texel] != Cover::part)
        return m_texels[texel] == Cover::whole;
    const auto parts = std::ranges::equal_range(m_parts, texel, {}, &Part::texel);
    return std::ranges::any_of(parts, [&](const Part& part) {
        return std::ranges::all_of(part.sides,
                                   [&](const Vec3& side) { return glm::dot(side, Vec3(position, 1.0)) >= 0.0; });
    });
}

}  // namespace beamspread
