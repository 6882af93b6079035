#include "scene/shadows.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace beamspread {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Height of the lamp above a vertex, relative to its height above the plane, below which the vertex counts as a shadow
// without an end: the shadow lies a million heights away, where irradiance is 1e-18 of the largest.
constexpr double min_relative_weight = 1e-6;

// Bound of the rounding of the computation here, texels: far above 65536 * 2^-53 = 7e-12, double precision at the largest
// texture's side.
constexpr double own_rounding = 1e-6;

// Number of facets above which tracing all rays of a million texels is faster than finding the shadows.
constexpr std::size_t max_facets = std::size_t{1} << 21;

// Sides of a box as triangles of Hull's corners.
constexpr std::array<std::array<unsigned, 3>, 12> box_facets = {{{0, 1, 3},
                                                                 {0, 3, 2},
                                                                 {4, 6, 7},
                                                                 {4, 7, 5},
                                                                 {0, 4, 5},
                                                                 {0, 5, 1},
                                                                 {2, 3, 7},
                                                                 {2, 7, 6},
                                                                 {0, 2, 6},
                                                                 {0, 6, 4},
                                                                 {1, 5, 7},
                                                                 {1, 7, 3}}};

struct Interval {
    double low = infinity;
    double high = -infinity;

    void extend(double x)
    {
        low = std::min(low, x);
        high = std::max(high, x);
    }
};

// A triangle's shadow in texels.
struct Shadow {
    std::array<Vec2, 3> corners;
    Vec2 reach{};           // largest move by rounding
    bool is_whole = false;  // true if an opaque triangle lies wholly between the starts and the ends of rays

    Interval rows() const
    {
        Interval rows;
        for (const Vec2& corner : corners)
            rows.extend(corner.y);
        return {rows.low - reach.y, rows.high + reach.y};
    }

    // The part of a horizontal line inside the shadow; may be empty.
    Interval cut(double y) const
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
};

// Central projection from the light onto the plane.
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

    struct Heights {
        std::array<double, 3> corners;
        double lowest;
        double highest;
        double rounding;  // bound of the rounding of a ray and of the triangle
    };

    Heights heights(const std::array<Vec3, 3>& triangle, double rounding) const
    {
        const auto height = [this](const Vec3& corner) { return glm::dot(corner - m_grid.origin, m_grid.normal); };
        const std::array<double, 3> all = {height(triangle[0]), height(triangle[1]), height(triangle[2])};
        const auto [lowest, highest] = std::minmax({all[0], all[1], all[2]});
        return {all, lowest, highest, std::max(m_start.rounding, rounding)};
    }

    // True if the triangle lies below the starts of rays, or beyond the lamp.
    bool is_off_the_way(const Heights& heights) const
    {
        const double lowest_start = m_start.clearance + 0.5 * m_start.rounding;
        return heights.highest + (heights.rounding - m_start.rounding) <= lowest_start ||
               (m_is_near > 0.0 && heights.lowest >= m_source_height + heights.rounding);
    }

    // True if the shadow has an end, not too far away.
    bool has_shadow(const Heights& heights) const
    {
        return m_source_height > 2.0 * m_start.height() &&
               weight(heights.highest) > min_relative_weight * m_source_height;
    }

    Shadow shadow(const std::array<Vec3, 3>& triangle, bool is_opaque, const Heights& heights) const
    {
        Shadow shadow{};
        for (std::size_t i = 0; i < 3; ++i)
            project(triangle[i], heights.corners[i], heights.rounding, shadow.corners[i], shadow.reach);
        const double margin = m_start.height() + heights.rounding;
        shadow.is_whole =
            is_opaque && heights.lowest >= margin && (m_is_near == 0.0 || heights.highest <= m_source_height - margin);
        return shadow;
    }

private:
    void project(const Vec3& vertex, double height, double rounding, Vec2& corner, Vec2& reach) const
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

    double weight(double height) const { return m_source_height - m_is_near * height; }

    const ReceiverGrid& m_grid;
    Vec3 m_source;  // from the grid's origin to a lamp; the unit vector towards a sun
    double m_is_near;
    double m_source_height;
    RayStart m_start;
};

// The nearest whole number of texels from 0 to `count`.
std::size_t clamped(double texel, std::size_t count)
{
    return static_cast<std::size_t>(std::clamp(texel, 0.0, static_cast<double>(count)));
}

void shade_row(const Shadow& shadow, std::size_t row, std::size_t width, Shade* texels)
{
    // Bounds of all rays that may start in the row, rounding included.
    const double bottom = static_cast<double>(row) - shadow.reach.y;
    const double top = static_cast<double>(row) + 1.0 + shadow.reach.y;
    const Interval low = shadow.cut(bottom);
    const Interval high = shadow.cut(top);

    Interval touched{std::min(low.low, high.low), std::max(low.high, high.high)};
    for (const Vec2& corner : shadow.corners)
        if (corner.y >= bottom && corner.y <= top)
            touched.extend(corner.x);
    const std::size_t end = clamped(std::ceil(touched.high + shadow.reach.x), width);
    for (std::size_t x = clamped(std::floor(touched.low - shadow.reach.x), width); x < end; ++x)
        texels[x] = std::max(texels[x], Shade::unknown);

    // A triangle is convex: a texel lies in it if the texel's corners do.
    if (!shadow.is_whole)
        return;
    const std::size_t full_begin = clamped(std::ceil(std::max(low.low, high.low) + shadow.reach.x), width);
    const std::size_t full_end = clamped(std::floor(std::min(low.high, high.high) - shadow.reach.x), width);
    if (full_begin < full_end)
        std::fill(texels + full_begin, texels + full_end, Shade::full);
}

}  // namespace

Shadows::Shadows(const ReceiverGrid& grid, const LightSource& source, const Occluders* occluders, const RayStart& start,
                 bool find)
    : m_grid(grid),
      m_source(source),
      m_occluders(occluders),
      m_start(start),
      m_is_unknown(occluders && (!find || grid.is_bent()))
{
    if (!occluders || m_is_unknown)
        return;
    const Projection projection(grid, source, start);
    if (!projection.is_lit())
        return;
    if (facet_count() > max_facets) {
        m_is_unknown = true;
        return;
    }
    m_leaves = std::bit_ceil(bands());
    m_nodes.resize(2 * m_leaves);
    for (std::size_t i = 0; i < facet_count(); ++i) {
        const Facet item = facet(i);
        const Projection::Heights heights = projection.heights(item.corners, item.rounding);
        if (projection.is_off_the_way(heights) && !(item.is_opaque && is_contact(grid, *occluders, i, start)))
            continue;
        // A box that holds the lamp has such sides; rays that end in the box need not cross them.
        if (!projection.has_shadow(heights)) {
            m_is_unknown = true;
            continue;
        }
        const Interval rows = projection.shadow(item.corners, item.is_opaque, heights).rows();
        if (rows.high < 0.0 || rows.low > static_cast<double>(grid.height))
            continue;
        std::size_t first = m_leaves + clamped(rows.low, grid.height - 1) / rows_per_band;
        std::size_t last = m_leaves + clamped(rows.high, grid.height - 1) / rows_per_band;
        while (last - first > 1) {
            first /= 2;
            last /= 2;
        }
        m_nodes[first].push_back(static_cast<std::uint32_t>(i));
        if (last != first)
            m_nodes[last].push_back(static_cast<std::uint32_t>(i));
    }
}

std::size_t Shadows::facet_count() const
{
    return m_occluders->own_count() + box_facets.size() * m_occluders->hulls().size();
}

Shadows::Facet Shadows::facet(std::size_t index) const
{
    if (index < m_occluders->own_count()) {
        const std::array<Vec3, 3> corners = m_occluders->triangle(index);
        return {corners, rounding_of(corners, m_occluders->origin()), index < m_occluders->own_opaque_count()};
    }
    const auto [hull, side] = std::lldiv(static_cast<long long>(index - m_occluders->own_count()), box_facets.size());
    const Hull& box = m_occluders->hulls()[static_cast<std::size_t>(hull)];
    const auto [a, b, c] = box_facets[static_cast<std::size_t>(side)];
    return {{box.corner(a), box.corner(b), box.corner(c)}, rounding_of(box), false};
}

void Shadows::shade_band(std::size_t band, std::vector<Shade>& texels) const
{
    const std::size_t begin = band * rows_per_band;
    const std::size_t end = std::min(begin + rows_per_band, m_grid.height);
    texels.assign((end - begin) * m_grid.width, m_is_unknown ? Shade::unknown : Shade::none);
    if (m_nodes.empty())
        return;
    const Projection projection(m_grid, m_source, m_start);
    for (std::size_t node = m_leaves + band; node > 0; node /= 2) {
        for (const std::uint32_t i : m_nodes[node]) {
            const Facet item = facet(i);
            const Projection::Heights heights = projection.heights(item.corners, item.rounding);
            const Shadow shadow = projection.shadow(item.corners, item.is_opaque, heights);
            const Interval rows = shadow.rows();
            const std::size_t first = std::max(begin, clamped(std::floor(rows.low), m_grid.height));
            const std::size_t last = std::min(end, clamped(std::ceil(rows.high), m_grid.height));
            for (std::size_t row = first; row < last; ++row)
                shade_row(shadow, row, m_grid.width, &texels[(row - begin) * m_grid.width]);
        }
    }
}

}  // namespace beamspread
