#include "scene/open_irradiance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/threads.h"

namespace beamspread {

namespace {

// Texels between nodes. More are faster and less exact.
constexpr std::size_t texels_per_node = 8;

// Distance to the light, in steps between nodes, above which irradiance is interpolated. Higher values are slower and more
// exact: here 1e-3 for a point, 5e-5 of the brightest for larger lights.
constexpr double steps_to_smooth_light = 12.0;

// Distance to the light, in texels, above which a texel's center gives its mean, to 6e-4 for a point. Higher values are
// slower and more exact.
constexpr double texels_to_even_light = 24.0;

// Weights of four neighbors at t in [0, 1] between the second and the third (Catmull and Rom 1974, "A class of local
// interpolating splines").
std::array<double, 4> spline_weights(double t)
{
    return {0.5 * t * (t * (2.0 - t) - 1.0), 0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
            0.5 * t * (t * (4.0 - 3.0 * t) + 1.0), 0.5 * t * t * (t - 1.0)};
}

}  // namespace

OpenIrradiance::OpenIrradiance(const ReceiverGrid& grid, const Light& light, bool at_centers)
    : m_grid(grid), m_light(light), m_pitch(std::max(grid.pitch_x, grid.pitch_y)), m_at_centers(at_centers)
{
    if (grid.is_bent()) {
        m_nodes.resize(grid.texels());
        parallel_for(grid.texels(), [&](std::size_t i) { m_nodes[i] = in_bent_texel(i); });
        return;
    }
    if (std::isinf(light.distance_from(grid.origin))) {
        m_everywhere = light.irradiance(grid.origin, grid.normal);
        return;
    }
    m_columns = grid.width / texels_per_node + 4;
    m_nodes.resize(m_columns * (grid.height / texels_per_node + 4));
    parallel_for(m_nodes.size(), [&](std::size_t i) {
        const auto texel_of = [](std::size_t node) {
            return (static_cast<double>(node) - 1.0) * static_cast<double>(texels_per_node);
        };
        m_nodes[i] = in_texel(texel_of(i % m_columns), texel_of(i / m_columns));
    });
}

Vec3 OpenIrradiance::at(std::size_t x, std::size_t y) const
{
    if (m_grid.is_bent())
        return m_nodes[y * m_grid.width + x];
    if (m_nodes.empty())
        return m_everywhere;
    const Vec3 point = m_grid.point(static_cast<double>(x), static_cast<double>(y));
    if (m_light.distance_from(point) > steps_to_smooth_light * static_cast<double>(texels_per_node) * m_pitch)
        return between_nodes(x, y);
    return in_texel(static_cast<double>(x), static_cast<double>(y));
}

Vec3 OpenIrradiance::in_bent_texel(std::size_t texel) const
{
    if (!m_grid.bent_texel(texel).is_inside())
        return Vec3(0.0);
    const std::size_t x = texel % m_grid.width;
    const std::size_t y = texel / m_grid.width;
    return in_texel(static_cast<double>(x), static_cast<double>(y), m_grid.normal_at(texel), m_grid.pitch_at(texel));
}

Vec3 OpenIrradiance::in_texel(double x, double y) const
{
    return in_texel(x, y, m_grid.normal, m_pitch);
}

Vec3 OpenIrradiance::in_texel(double x, double y, const Vec3& normal, double pitch) const
{
    const auto at = [&](double sub_x, double sub_y) {
        return m_light.irradiance(m_grid.point(x + sub_x, y + sub_y), normal);
    };
    if (m_at_centers || m_light.distance_from(m_grid.point(x, y)) > texels_to_even_light * pitch)
        return at(0.5, 0.5);
    // The Gauss rule of two points along each axis.
    constexpr double offset = 0.5 / std::numbers::sqrt3;
    return 0.25 * (at(0.5 - offset, 0.5 - offset) + at(0.5 + offset, 0.5 - offset) + at(0.5 - offset, 0.5 + offset) +
                   at(0.5 + offset, 0.5 + offset));
}

Vec3 OpenIrradiance::between_nodes(std::size_t x, std::size_t y) const
{
    const auto part = [](std::size_t texel) {
        return static_cast<double>(texel % texels_per_node) / static_cast<double>(texels_per_node);
    };
    const std::array<double, 4> across = spline_weights(part(x));
    const std::array<double, 4> up = spline_weights(part(y));
    Vec3 sum(0.0);
    for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i)
            sum += up[j] * across[i] * m_nodes[(y / texels_per_node + j) * m_columns + x / texels_per_node + i];
    return glm::max(sum, Vec3(0.0));
}

}  // namespace beamspread
