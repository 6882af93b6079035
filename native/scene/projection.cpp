#include "scene/projection.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

// Height of the lamp above a vertex, relative to its height above the plane, below which the vertex counts as a shadow
// without an end: the shadow lies a million heights away, where irradiance is 1e-18 of the largest.
constexpr double min_relative_weight = 1e-6;

// Bound of the rounding of the computation here, texels: far above 65536 * 2^-53 = 7e-12, double precision at the largest
// texture's side.
constexpr double own_rounding = 1e-6;

}  // namespace

void Interval::extend(double x)
{
    low = std::min(low, x);
    high = std::max(high, x);
}

void Interval::extend(const Interval& other)
{
    low = std::min(low, other.low);
    high = std::max(high, other.high);
}

Interval Shadow::columns() const
{
    Interval columns;
    for (const Vec2& corner : corners)
        columns.extend(corner.x);
    return {columns.low - reach.x, columns.high + reach.x};
}

Interval Shadow::rows() const
{
    Interval rows;
    for (const Vec2& corner : corners)
        rows.extend(corner.y);
    return {rows.low - reach.y, rows.high + reach.y};
}

Interval Shadow::cut(double y) const
{
    Interval cut;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec2& a = corners[i];
        const Vec2& b = corners[(i + 1) % 3];
        if ((a.y <= y) != (b.y <= y))
            cut.extend(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
    }
    return cut;
}

Projection::Projection(const ReceiverGrid& grid, const LightSource& source, const RayStart& start)
    : m_grid(grid),
      m_source(source.position - (source.is_far ? Vec3(0.0) : grid.origin)),
      m_is_near(source.is_far ? 0.0 : 1.0),
      m_source_height(glm::dot(m_source, grid.normal)),
      m_start(start)
{
}

Projection::Heights Projection::heights(const std::array<Vec3, 3>& triangle, double rounding) const
{
    const auto height = [this](const Vec3& corner) { return glm::dot(corner - m_grid.origin, m_grid.normal); };
    const std::array<double, 3> all = {height(triangle[0]), height(triangle[1]), height(triangle[2])};
    const auto [lowest, highest] = std::minmax({all[0], all[1], all[2]});
    return {all, lowest, highest, std::max(m_start.rounding, rounding)};
}

bool Projection::is_off_the_way(const Heights& heights) const
{
    const double lowest_start = m_start.clearance + 0.5 * m_start.rounding;
    return heights.highest + (heights.rounding - m_start.rounding) <= lowest_start ||
           (m_is_near > 0.0 && heights.lowest >= m_source_height + heights.rounding);
}

bool Projection::has_shadow(const Heights& heights) const
{
    return m_source_height > 2.0 * m_start.height() && weight(heights.highest) > min_relative_weight * m_source_height;
}

Shadow Projection::shadow(const std::array<Vec3, 3>& triangle, bool is_opaque, const Heights& heights) const
{
    Shadow shadow{};
    for (std::size_t i = 0; i < 3; ++i)
        project(triangle[i], heights.corners[i], heights.rounding, shadow.corners[i], shadow.reach);
    const double margin = m_start.height() + heights.rounding;
    shadow.is_whole =
        is_opaque && heights.lowest >= margin && (m_is_near == 0.0 || heights.highest <= m_source_height - margin);
    return shadow;
}

void Projection::project(const Vec3& vertex, double height, double rounding, Vec2& corner, Vec2& reach) const
{
    // With heights h above the plane: p = (h_s v - h_v s) / (h_s - h_v) for a lamp at s, and for a sun in the
    // direction s p = v - (h_v / h_s) s.
    const Vec3 point = (m_source_height * (vertex - m_grid.origin) - height * m_source) / weight(height);
    corner = {glm::dot(point, m_grid.x_axis) / m_grid.pitch_x, glm::dot(point, m_grid.y_axis) / m_grid.pitch_y};
    // A step of 1 at the vertex or at the ray's start moves the shadow by up to this factor: 1 / cos for a sun,
    // larger for a lamp.
    const double magnification = glm::length(m_source - m_is_near * point) / weight(height);
    const double step = 2.0 * (m_start.clearance + rounding) * magnification;
    reach = glm::max(reach, Vec2(step / m_grid.pitch_x, step / m_grid.pitch_y) + own_rounding);
}

}  // namespace beamspread
