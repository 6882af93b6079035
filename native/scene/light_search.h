// Search for light that few rays find, as through a window: by tiles of texels, from those that have found some.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/sobol.h"
#include "scene/light_guide.h"

namespace beamspread {

// Traces a ray from each position on a plane (texels) to the place of the light's unit square of the same index. Writes
// 1 where light arrives, and 0 elsewhere. Any thread calls it.
using ProbeLight =
    std::function<void(std::span<const Vec2> positions, std::span<const Vec2> places, std::uint8_t* arrives)>;

// Rays of the first pass from some texels: their number, and their light, mean of the channels, if nothing blocked it and
// as it arrives, summed over the texels, W/m^2.
struct FirstRays {
    std::uint32_t traced = 0;
    float open = 0.0f;
    float irradiance = 0.0f;
};

class LightSearch {
public:
    static constexpr std::size_t tile_side = 8;  // texels

    // `rays`: the largest number of rays of a texel.
    LightSearch(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed);

    // Number of tiles in a row.
    std::size_t columns() const { return m_columns; }

    // Notes rays of some texels in the tile of texel (x, y), and the hits of those that get through; one thread at a time
    // for each row of tiles.
    void note(std::size_t x, std::size_t y, const FirstRays& rays, std::span<const LightHit> hits);

    // Traces rays around hits from tiles that see little light, and goes on in their neighbors until no tile finds more.
    void spread(const ProbeLight& probe, Progress& progress);

    // Irradiance of the tile of texel (x, y) if nothing blocked the light, relative to the mean of tiles that see light in
    // the first pass; known after `spread`.
    double open_brightness(std::size_t x, std::size_t y) const { return tile_of(x, y).open / m_mean; }

    // True if few rays from the tile of a texel get through, so that guided rays have less noise.
    bool is_rare(std::size_t x, std::size_t y) const { return tile_of(x, y).is_rare(); }

    // Tiles whose guides may miss the light of some texels, and the tiles beside these. None if a light is not rare.
    std::vector<std::size_t> find_hard_tiles() const;

    // True if the tile of texel (x, y) or one of its neighbors has a hit.
    bool has_hits_around(std::size_t x, std::size_t y) const;

    // The guide of the tile of texel (x, y), if there are hits around.
    void find_guide(std::size_t x, std::size_t y, LightGuide& guide) const;

private:
    struct Tile {
        std::vector<LightHit> hits;
        std::size_t traced = 0, arrived = 0;  // rays of the first pass
        std::size_t replaced = 0;             // hits of the first pass that others have replaced
        double irradiance = 0.0;              // mean of texels and channels, W/m^2
        double open = 0.0;                    // the same if nothing blocked the light
        int searches = 0;
        std::size_t found = 0;  // hits of the last search, before some of them are kept
        double visible = 0.0;   // part of the light that arrives, by the last search
        bool has_news = false;  // hits that its neighbors have not used

        bool is_rare() const;
        // True if its guide may miss the light of some texels.
        bool is_hard(std::size_t search_rays) const;
        // Irradiance by the first pass or the last search, W/m^2.
        double brightness() const { return std::max(irradiance, visible * open); }
        void keep_first(std::span<const LightHit> new_hits);
        void keep(std::span<const LightHit> new_hits);
    };

    const Tile& tile_of(std::size_t x, std::size_t y) const
    {
        return m_tiles[y / tile_side * m_columns + x / tile_side];
    }
    template <class Visit>
    void visit_around(std::size_t tile, const Visit& visit) const;
    std::vector<LightHit> hits_around(std::size_t tile) const;
    static int max_searches_of(const Tile& tile);
    bool is_due(std::size_t tile) const;
    // Hits of a search that may be kept, the number of all, and the part of the light that arrives.
    struct Found {
        std::vector<LightHit> hits;
        std::size_t count = 0;
        double visible = 0.0;
    };
    Found search(std::size_t tile, const ProbeLight& probe) const;
    void find_mean();

    std::size_t m_width, m_height, m_columns, m_rows;
    std::size_t m_search_rays;
    GridSobol m_sobol;
    std::vector<Tile> m_tiles;
    double m_mean = 1.0;  // irradiance of tiles that see light, W/m^2
};

}  // namespace beamspread
