#include "scene/open_tiles.h"

#include <algorithm>
#include <array>
#include <limits>

namespace beamspread {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
// A vertex nearly as high as the lamp throws its shadow too far to be worth finding.
constexpr double min_relative_weight = 1e-6;

// Central projection from the light onto the plane, in texels.
class Projection {
public:
    Projection(const ReceiverGrid& grid, const LightSource& source, const RayStart& start)
        : m_grid(grid),
          m_source(source.position - (source.is_far ? Vec3(0.0) : grid.origin)),
          m_is_near(source.is_far ? 0.0 : 1.0),
          m_source_height(glm::dot(m_source, grid.normal)),
          m_start(start)
    {
    }

    bool is_lit() const { return m_source_height > 0.0; }

    double height(const Vec3& vertex) const { return glm::dot(vertex - m_grid.origin, m_grid.normal); }

    // Whether a triangle with such vertices lies behind where rays start, or beyond the lamp where they end.
    bool is_off_the_way(double lowest, double highest) const
    {
        return highest <= m_start.height() - 0.5 * m_start.rounding ||
               (m_is_near > 0.0 && lowest >= m_source_height + m_start.rounding);
    }

    // Whether the shadow of a vertex at that height is a point on the plane, not too far away.
    bool has_shadow(double height) const
    {
        return m_source_height > 2.0 * m_start.height() && weight(height) > min_relative_weight * m_source_height;
    }

    // Extends low and high to what the vertex, moved by the rounding, can shade.
    void extend(const Vec3& vertex, double height, Vec2& low, Vec2& high) const
    {
        // With heights h above the plane: p = (h_s v - h_v s) / (h_s - h_v) for a lamp at s, and for a sun in the
        // direction s p = v - (h_v / h_s) s.
        const Vec3 shadow = (m_source_height * (vertex - m_grid.origin) - height * m_source) / weight(height);
        // A step of 1 at the vertex or at the ray's start moves the shadow by up to this: 1 / cos for a sun, for a lamp
        // magnified besides.
        const double magnification = glm::length(m_source - m_is_near * shadow) / weight(height);
        const double reach = 2.0 * m_start.height() * magnification;
        const Vec2 centre(glm::dot(shadow, m_grid.x_axis) / m_grid.pitch_x,
                          glm::dot(shadow, m_grid.y_axis) / m_grid.pitch_y);
        const Vec2 margin(1.0 + reach / m_grid.pitch_x, 1.0 + reach / m_grid.pitch_y);
        low = glm::min(low, centre - margin);
        high = glm::max(high, centre + margin);
    }

private:
    double weight(double height) const { return m_source_height - m_is_near * height; }

    const ReceiverGrid& m_grid;
    Vec3 m_source;  // from the grid's origin to a lamp; the unit vector towards a sun
    double m_is_near;
    double m_source_height;
    RayStart m_start;
};

}  // namespace

OpenTiles::OpenTiles(const ReceiverGrid& grid, const LightSource& source, const Occluders* occluders,
                     const RayStart& start)
    : m_columns((grid.width + tile_side - 1) / tile_side), m_rows((grid.height + tile_side - 1) / tile_side)
{
    const Projection projection(grid, source, start);
    if (!occluders || !projection.is_lit())
        return;
    m_shaded.assign(m_columns * m_rows, 0);
    for (std::size_t i = 0; i < occluders->triangle_count(); ++i) {
        const std::array<Vec3, 3> triangle = occluders->triangle(i);
        const std::array<double, 3> heights = {projection.height(triangle[0]), projection.height(triangle[1]),
                                               projection.height(triangle[2])};
        const auto [lowest, highest] = std::minmax({heights[0], heights[1], heights[2]});
        if (projection.is_off_the_way(lowest, highest))
            continue;
        if (!projection.has_shadow(highest)) {
            shade(Vec2(0.0), Vec2(infinity));
            return;
        }
        Vec2 low(infinity);
        Vec2 high(-infinity);
        for (std::size_t corner = 0; corner < 3; ++corner)
            projection.extend(triangle[corner], heights[corner], low, high);
        shade(low, high);
    }
}

void OpenTiles::shade(Vec2 low, Vec2 high)
{
    constexpr auto side = static_cast<double>(tile_side);
    const auto tile = [](double texel, std::size_t count) {
        return static_cast<std::size_t>(std::clamp(texel / side, 0.0, static_cast<double>(count)));
    };
    const std::size_t end_x = tile(high.x + side, m_columns);
    const std::size_t end_y = tile(high.y + side, m_rows);
    for (std::size_t y = tile(low.y, m_rows); y < end_y; ++y)
        for (std::size_t x = tile(low.x, m_columns); x < end_x; ++x)
            m_shaded[y * m_columns + x] = 1;
}

}  // namespace beamspread
