#include "scene/bent_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Largest error of the length of a normal or a tangent: they are interpolated in single precision.
constexpr double unit_tolerance = 1e-3;

// Smallest sine of the angle between a tangent and its normal; below, the tangent's direction is rounding.
constexpr double min_sine = 1e-3;

// Neighbors in the texture are neighbors on the mesh if their distance differs from their steps by less than this part of
// these, and the cosine of their normals is larger. Larger, smaller: light is interpolated across seams and sharp edges.
constexpr double largest_gap = 0.25;
constexpr float least_neighbor_cosine = 0.9f;

void check_unit(const char* name, const Vec3& vector)
{
    if (!(std::abs(glm::length(vector) - 1.0) <= unit_tolerance))
        reject(name, detail::to_text(vector), "unit vectors, or a normal 0 outside of the mesh");
}

// Checks a texel inside the mesh, and completes it.
void complete(BentTexel& texel)
{
    detail::check_finite("positions", texel.position);
    check_unit("normals", Vec3(texel.normal));
    check_unit("tangents", Vec3(texel.tangent));
    if (!(texel.area >= 0.0f) || !std::isfinite(texel.area))
        reject("areas", static_cast<double>(texel.area), "finite areas >= 0 in square metres");
    const Vec3 normal = glm::normalize(Vec3(texel.normal));
    const Vec3 across = Vec3(texel.tangent) - normal * glm::dot(Vec3(texel.tangent), normal);
    if (!(glm::length(across) >= min_sine))
        reject("tangents", detail::to_text(Vec3(texel.tangent)), "vectors across the normals");
    const Vec3 face = glm::cross(Vec3(texel.step_x), Vec3(texel.step_y));
    const double size = glm::length(face);
    if (!(size > 0.0) || !std::isfinite(size))
        reject("steps_x", detail::to_text(Vec3(texel.step_x)), "finite vectors that span the face with steps_y");
    texel.normal = Vec3f(normal);
    texel.tangent = Vec3f(glm::normalize(across));
    texel.face = Vec3f(glm::dot(face, normal) < 0.0 ? -face / size : face / size);
}

}  // namespace

double BentTexel::pitch() const
{
    return static_cast<double>(std::max(glm::length(step_x), glm::length(step_y)));
}

bool BentTexel::is_mirrored() const
{
    return glm::dot(glm::cross(Vec3(normal), Vec3(tangent)), Vec3(step_y)) < 0.0;
}

bool are_neighbors(const BentTexel& a, const BentTexel& b, Vec3f BentTexel::* step)
{
    const Vec3 expected = 0.5 * Vec3(a.*step + b.*step);
    return glm::length(b.position - a.position - expected) <= largest_gap * glm::length(expected) &&
           glm::dot(a.normal, b.normal) >= least_neighbor_cosine;
}

BentShape::BentShape(std::vector<BentTexel> all) : texels(std::move(all))
{
    low = Vec3(std::numeric_limits<double>::infinity());
    high = -low;
    for (BentTexel& texel : texels) {
        if (!texel.is_inside()) {
            texel = {};
            continue;
        }
        complete(texel);
        ++inside;
        area += static_cast<double>(texel.area);
        for (const Vec2 corner : {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0), Vec2(1.0, 1.0)}) {
            const Vec3 point = texel.point(corner.x, corner.y);
            low = glm::min(low, point);
            high = glm::max(high, point);
        }
    }
    if (inside == 0)
        low = high = Vec3(0.0);
}

}  // namespace beamspread
