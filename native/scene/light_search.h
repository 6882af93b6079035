// Search for light that few rays find, as through a window: by tiles of texels, from those that have found some.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/sobol.h"
#include "scene/light_guide.h"

namespace beamspread {

// Traces a ray from each position on a plane (texels) to the place of the light's unit square of the same index. Writes
// 1 where light arrives, and 0 elsewhere. Any thread calls it.
using ProbeLight =
    std::function<void(std::span<const Vec2> positions, std::span<const Vec2> places, std::uint8_t* arrives)>;

class LightSearch {
public:
    static constexpr std::size_t tile_side = 8;  // texels

    // `rays`: the largest number of rays of a texel.
    LightSearch(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed);

    // Number of tiles in a row.
    std::size_t columns() const { return m_columns; }

    // Notes a ray of the first pass from texel (x, y); one thread at a time for each row of tiles.
    void note(std::size_t x, std::size_t y, const LightHit& hit, bool is_blocked);

    // Traces rays around hits from tiles that see little light, and goes on in their neighbors until no tile finds more.
    void spread(const ProbeLight& probe);

    // True if few rays from the tile of a texel get through, so that guided rays have less noise.
    bool is_rare(std::size_t x, std::size_t y) const { return tile_of(x, y).is_rare(); }

    // True if the tile of texel (x, y) or one of its neighbors has a hit.
    bool has_hits_around(std::size_t x, std::size_t y) const;

    // The guide of the tile of texel (x, y), if there are hits around.
    void find_guide(std::size_t x, std::size_t y, LightGuide& guide) const;

private:
    struct Tile {
        std::vector<LightHit> hits;
        std::uint32_t traced = 0, arrived = 0;  // rays of the first pass
        int searches = 0;
        bool has_news = false;  // hits that its neighbors have not used

        bool is_rare() const;
        void keep(std::span<const LightHit> new_hits);
    };

    const Tile& tile_of(std::size_t x, std::size_t y) const
    {
        return m_tiles[y / tile_side * m_columns + x / tile_side];
    }
    template <class Visit>
    void visit_around(std::size_t tile, const Visit& visit) const;
    std::vector<LightHit> hits_around(std::size_t tile) const;
    bool is_due(std::size_t tile) const;
    std::vector<LightHit> search(std::size_t tile, const ProbeLight& probe) const;

    std::size_t m_width, m_height, m_columns, m_rows;
    std::size_t m_search_rays;
    GridSobol m_sobol;
    std::vector<Tile> m_tiles;
};

}  // namespace beamspread
