#include "scene/open_tiles.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "base/threads.h"
#include "scene/contacts.h"
#include "scene/facets.h"
#include "scene/projection.h"

namespace beamspread {

namespace {

// Facets whose shadows one thread finds at a time.
constexpr std::size_t facets_at_once = 1024;

// Rectangles of tiles, counted by differences at their corners, so that a large one costs as little as a small one.
class Rectangles {
public:
    Rectangles() = default;
    Rectangles(std::size_t columns, std::size_t rows) : m_stride(columns + 1), m_steps(m_stride * (rows + 1), 0) {}

    bool empty() const { return m_steps.empty(); }

    // Tiles [left, right) of the rows [bottom, top).
    void add(std::size_t left, std::size_t right, std::size_t bottom, std::size_t top)
    {
        ++m_steps[bottom * m_stride + left];
        --m_steps[bottom * m_stride + right];
        --m_steps[top * m_stride + left];
        ++m_steps[top * m_stride + right];
    }

    void add(const Rectangles& others)
    {
        std::ranges::transform(m_steps, others.m_steps, m_steps.begin(), std::plus{});
    }

    // The tiles that no rectangle covers.
    std::vector<std::uint8_t> uncovered() const
    {
        const std::size_t columns = m_stride - 1;
        const std::size_t rows = m_steps.size() / m_stride - 1;
        std::vector<std::int32_t> counts(columns, 0);
        std::vector<std::uint8_t> tiles(columns * rows);
        for (std::size_t y = 0; y < rows; ++y) {
            std::int32_t along_row = 0;
            for (std::size_t x = 0; x < columns; ++x) {
                along_row += m_steps[y * m_stride + x];
                counts[x] += along_row;
                tiles[y * columns + x] = counts[x] == 0;
            }
        }
        return tiles;
    }

private:
    std::size_t m_stride = 0;
    std::vector<std::int32_t> m_steps;
};

}  // namespace

OpenTiles::OpenTiles(const ReceiverGrid& grid, const Light& light, const Occluders& occluders, const RayStart& start,
                     std::size_t tile_side)
    : m_tile_side(tile_side), m_columns((grid.width + tile_side - 1) / tile_side)
{
    const std::size_t tile_rows = (grid.height + tile_side - 1) / tile_side;
    const std::size_t facets = facet_count(occluders);
    const std::vector<LightSource> corners = light.corners();
    if (grid.is_bent() || corners.empty() || facets > grid.texels())
        return;
    std::vector<Projection> projections;
    for (const LightSource& corner : corners)
        projections.emplace_back(grid, corner, start);

    // The shadow of a facet by all points of a light lies within the hull of its shadows by the light's corners: the
    // projection of a point is a ratio of linear functions of the point, and of the light's place.
    PerThread<Rectangles> shaded;
    std::atomic<bool> has_end = true;
    const auto add_shadow = [&](std::size_t i) {
        const Facet item = facet(occluders, i);
        Interval columns;
        Interval rows;
        const Projection::Heights heights = projections.front().heights(item.corners, item.rounding);
        const bool is_off_the_way =
            std::ranges::all_of(projections, [&](const Projection& from) { return from.is_off_the_way(heights); });
        if (is_off_the_way && !(item.is_opaque && is_contact(grid, occluders, i, start)))
            return;
        for (const Projection& from : projections) {
            if (!from.has_shadow(heights)) {
                has_end = false;
                return;
            }
            const Shadow shadow = from.shadow(item.corners, item.is_opaque, heights);
            columns.extend(shadow.columns());
            rows.extend(shadow.rows());
        }
        // With the neighbors of the tiles.
        const auto tile = [&](double texel, double beside, std::size_t count) {
            const double place = std::floor(texel / static_cast<double>(m_tile_side)) + beside;
            return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(count)));
        };
        Rectangles& own = shaded.local();
        if (own.empty())
            own = Rectangles(m_columns, tile_rows);
        own.add(tile(columns.low, -1.0, m_columns), tile(columns.high, 2.0, m_columns), tile(rows.low, -1.0, tile_rows),
                tile(rows.high, 2.0, tile_rows));
    };
    parallel_for((facets + facets_at_once - 1) / facets_at_once, [&](std::size_t run) {
        const std::size_t end = std::min((run + 1) * facets_at_once, facets);
        for (std::size_t i = run * facets_at_once; i < end && has_end; ++i)
            add_shadow(i);
    });
    if (!has_end)
        return;
    Rectangles all(m_columns, tile_rows);
    for (const Rectangles& of_thread : shaded)
        if (!of_thread.empty())
            all.add(of_thread);
    m_is_open = all.uncovered();
}

}  // namespace beamspread
