// Planes of texels dealt to sublattices: texels whose coordinates agree modulo the number of sublattices lie side by side.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/threads.h"
#include "base/view.h"
#include "solve/textured/path_products.h"
#include "solve/textured/shared_paths.h"

namespace beamspread {

// Indices in a plane of the places that texels of one sublattice see, less that of the tile of these texels.
class Offsets {
public:
    Offsets(std::vector<std::ptrdiff_t> across, std::vector<std::ptrdiff_t> down, std::size_t reach)
        : m_across(std::move(across)), m_down(std::move(down)), m_reach(static_cast<std::int32_t>(reach))
    {
    }

    std::ptrdiff_t operator()(const PathPlace& place) const
    {
        return m_across[static_cast<std::size_t>(std::clamp(place.x, -m_reach, m_reach) + m_reach)] +
               m_down[static_cast<std::size_t>(std::clamp(place.y, -m_reach, m_reach) + m_reach)];
    }

private:
    std::vector<std::ptrdiff_t> m_across;  // [x + reach]
    std::vector<std::ptrdiff_t> m_down;
    std::int32_t m_reach;
};

class Sublattices {
public:
    // `side`: sublattices along each axis. `reach`: largest offset of a place, texels; farther ones count as at the same
    // distance along each axis.
    Sublattices(std::size_t width, std::size_t height, std::size_t side, std::size_t reach);

    std::size_t width() const { return m_width; }
    std::size_t height() const { return m_height; }
    std::size_t side() const { return m_side; }
    std::size_t count() const { return m_side * m_side; }
    std::size_t reach() const { return m_reach; }
    // Tiles of `tile_rows` by `tile_columns` texels in each sublattice.
    std::size_t tiles_down() const { return m_tiles_down; }
    std::size_t tiles_across() const { return m_tiles_across; }
    std::size_t tile_count() const { return m_tiles_down * m_tiles_across; }

    // Index in a plane of the first texel of a tile of the first sublattice.
    std::size_t tile(std::size_t down, std::size_t across) const;

    // Texels from a row of a plane to the next.
    std::size_t stride() const { return m_tiles_across * tile_columns + 2 * m_border; }

    // Texels along each axis that show one texel of a map of this size: a divisor of `side`, or 1 if the map's texels are
    // no such squares.
    std::size_t texels_of(const View2D<const float>& map) const;

    // Offsets for texels of this sublattice, in planes of maps whose texels are shown by `texels` of the plane's along each
    // axis.
    Offsets offsets(std::size_t sublattice, std::size_t texels) const;
    bool is_within(const PathPlace& place) const;

    // A plane of these sublattices, or of those that `texels_of` a coarser map need. Beyond the border values continue,
    // or they are 0. Maps of other sizes show the nearest texels.
    AlignedVector<float> dealt(const View2D<const float>& values, float factor, bool goes_on) const;

    // Calls set(y, x, index in the tiles of this sublattice, one after the other) for each texel.
    template <class Set>
    void for_texels(std::size_t sublattice, const Set& set) const
    {
        for (std::size_t y = sublattice / m_side; y < m_height; y += m_side) {
            const std::size_t row = y / m_side;
            const std::size_t first = row / tile_rows * m_tiles_across * tile_texels + row % tile_rows * tile_columns;
            for (std::size_t x = sublattice % m_side; x < m_width; x += m_side) {
                const std::size_t column = x / m_side;
                set(y, x, first + column / tile_columns * tile_texels + column % tile_columns);
            }
        }
    }

private:
    std::size_t m_width;
    std::size_t m_height;
    std::size_t m_side;  // sublattices along each axis
    std::size_t m_tiles_down;
    std::size_t m_tiles_across;
    std::size_t m_border;  // around each sublattice, its texels
    std::size_t m_reach;
};

}  // namespace beamspread
