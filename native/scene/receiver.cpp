#include "scene/receiver.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Largest error of a unit vector: axes come from object matrices in single precision.
constexpr double axis_tolerance = 1e-4;

// Texels along a side, as Blender's own images allow.
constexpr std::size_t max_side = 1u << 16;

void check_unit(const std::string& name, const Vec3& axis)
{
    if (!(std::abs(glm::length(axis) - 1.0) <= axis_tolerance))
        reject(name, detail::to_text(axis), "a unit vector");
}

void check_perpendicular(const std::string& name, const Vec3& axis, const Vec3& other)
{
    if (std::abs(glm::dot(axis, other)) > axis_tolerance)
        reject(name, detail::to_text(axis), "a vector at right angles to the other axes");
}

void check_pitch(const std::string& name, double pitch)
{
    if (!(pitch > 0.0) || !std::isfinite(pitch))
        reject(name, pitch, "a finite length > 0 in metres");
}

void check_side(const std::string& name, std::size_t side)
{
    if (side < 1 || side > max_side)
        reject(name, std::to_string(side), "1 to " + std::to_string(max_side) + " texels");
}

}  // namespace

ReceiverGrid ReceiverGrid::bent(std::vector<BentTexel> texels, std::size_t width, std::size_t height,
                                std::uint32_t owner)
{
    check_side("width", width);
    check_side("height", height);
    ReceiverGrid grid{.width = width, .height = height, .owner = owner};
    grid.shape = std::make_shared<const BentShape>(std::move(texels));
    const double inside = static_cast<double>(std::max<std::size_t>(grid.shape->inside, 1));
    grid.pitch_x = grid.pitch_y = std::sqrt(grid.shape->area / inside);
    return grid;
}

Vec3 ReceiverGrid::bent_point(double x, double y) const
{
    const std::size_t texel = texel_at(x, y);
    return bent_texel(texel).point(x - static_cast<double>(texel % width), y - static_cast<double>(texel / width));
}

std::vector<Vec3> ReceiverGrid::points() const
{
    constexpr std::size_t last = 4;  // along each side
    const auto place = [](std::size_t i, std::size_t texels) {
        return static_cast<double>(i * texels) / static_cast<double>(last);
    };
    std::vector<Vec3> corners, others;
    for (std::size_t row = 0; row <= last; ++row)
        for (std::size_t column = 0; column <= last; ++column) {
            const bool is_corner = column % last == 0 && row % last == 0;
            (is_corner ? corners : others).push_back(point(place(column, width), place(row, height)));
        }
    corners.insert(corners.end(), others.begin(), others.end());
    return corners;
}

double ReceiverGrid::reach(const Vec3& center) const
{
    if (is_bent()) {
        const Vec3 offset = glm::max(glm::abs(shape->low - center), glm::abs(shape->high - center));
        return std::max({offset.x, offset.y, offset.z});
    }
    const double w = static_cast<double>(width);
    const double h = static_cast<double>(height);
    double largest = 0.0;
    for (const Vec3& corner : {point(0, 0), point(w, 0), point(0, h), point(w, h)}) {
        const Vec3 offset = glm::abs(corner - center);
        largest = std::max({largest, offset.x, offset.y, offset.z});
    }
    return largest;
}

void ReceiverGrid::check() const
{
    if (is_bent())
        return;  // checked when it was made
    detail::check_finite("origin", origin);
    check_unit("x_axis", x_axis);
    check_unit("y_axis", y_axis);
    check_unit("normal", normal);
    check_perpendicular("y_axis", y_axis, x_axis);
    check_perpendicular("normal", normal, x_axis);
    check_perpendicular("normal", normal, y_axis);
    check_pitch("pitch_x", pitch_x);
    check_pitch("pitch_y", pitch_y);
    check_side("width", width);
    check_side("height", height);
}

}  // namespace beamspread
