#include "scene/shadows.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/facets.h"
#include "scene/projection.h"

namespace beamspread {

namespace {

// Number of facets above which tracing all rays of a million texels is faster than finding the shadows.
constexpr std::size_t max_facets = std::size_t{1} << 21;

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
    if (facet_count(*occluders) > max_facets) {
        m_is_unknown = true;
        return;
    }
    m_leaves = std::bit_ceil(bands());
    m_nodes.resize(2 * m_leaves);
    for (std::size_t i = 0; i < facet_count(*occluders); ++i) {
        const Facet item = facet(*m_occluders, i);
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
            const Facet item = facet(*m_occluders, i);
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
