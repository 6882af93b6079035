#include "solve/textured/sublattice.h"

#include <algorithm>

#include "solve/textured/nearest_texels.h"

namespace beamspread {

namespace {

std::ptrdiff_t floor_div(std::ptrdiff_t value, std::ptrdiff_t divisor)
{
    return value >= 0 ? value / divisor : -((-value + divisor - 1) / divisor);
}

}  // namespace

Sublattices::Sublattices(std::size_t width, std::size_t height, std::size_t side, std::size_t reach)
    : m_width(width), m_height(height), m_side(side)
{
    m_tiles_down = (height + m_side * tile_rows - 1) / (m_side * tile_rows);
    m_tiles_across = (width + m_side * tile_columns - 1) / (m_side * tile_columns);
    m_reach = std::min(reach, std::max(width, height));
    m_border = (m_reach + m_side - 1) / m_side + 1;
}

std::size_t Sublattices::tile(std::size_t down, std::size_t across) const
{
    return (down * tile_rows + m_border) * stride() + m_border + across * tile_columns;
}

bool Sublattices::is_within(const PathPlace& place) const
{
    const auto reach = static_cast<std::int32_t>(m_reach);
    return std::abs(place.x) <= reach && std::abs(place.y) <= reach;
}

std::size_t Sublattices::texels_of(const View2D<const float>& map) const
{
    for (std::size_t texels = m_side; texels > 1; --texels)
        if (m_side % texels == 0 && map.width * texels == m_width && map.height * texels == m_height)
            return texels;
    return 1;
}

Offsets Sublattices::offsets(std::size_t sublattice, std::size_t texels) const
{
    const auto of_map = static_cast<std::ptrdiff_t>(texels), side = static_cast<std::ptrdiff_t>(m_side / texels);
    const auto reach = static_cast<std::ptrdiff_t>(m_reach);
    const auto row = static_cast<std::ptrdiff_t>(stride());
    const auto plane = row * static_cast<std::ptrdiff_t>(m_tiles_down * tile_rows + 2 * m_border);
    const auto along = [&](std::size_t first, std::ptrdiff_t of_sublattice, std::ptrdiff_t of_texel) {
        std::vector<std::ptrdiff_t> offsets;
        for (std::ptrdiff_t away = -reach; away <= reach; ++away) {
            const std::ptrdiff_t at = floor_div(static_cast<std::ptrdiff_t>(first) + away, of_map);
            const std::ptrdiff_t texel = floor_div(at, side);
            offsets.push_back((at - texel * side) * of_sublattice + texel * of_texel);
        }
        return offsets;
    };
    return {along(sublattice % m_side, plane, 1), along(sublattice / m_side, side * plane, row), m_reach};
}

AlignedVector<float> Sublattices::dealt(const View2D<const float>& values, float factor, bool goes_on) const
{
    const std::size_t texels = texels_of(values), columns = stride(), rows = m_tiles_down * tile_rows + 2 * m_border;
    const std::size_t all = m_side / texels * (m_side / texels);
    AlignedVector<float> plane(all * rows * columns);
    const NearestTexels map(values, m_height / texels, m_width / texels);
    const auto side = static_cast<std::ptrdiff_t>(m_side / texels), border = static_cast<std::ptrdiff_t>(m_border);
    const auto width = static_cast<std::ptrdiff_t>(m_width / texels);
    const auto height = static_cast<std::ptrdiff_t>(m_height / texels);
    parallel_for(all * rows, [&](std::size_t task) {
        const auto sublattice = static_cast<std::ptrdiff_t>(task / rows);
        const std::ptrdiff_t y = (static_cast<std::ptrdiff_t>(task % rows) - border) * side + sublattice / side;
        if (!goes_on && (y < 0 || y >= height))
            return;
        const auto row = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(y, 0, height - 1));
        float* const filled = plane.data() + task * columns;
        for (std::size_t column = 0; column < columns; ++column) {
            const std::ptrdiff_t x = (static_cast<std::ptrdiff_t>(column) - border) * side + sublattice % side;
            if (goes_on || (x >= 0 && x < width))
                filled[column] =
                    factor * map(row, static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(x, 0, width - 1)));
        }
    });
    return plane;
}

}  // namespace beamspread
