// Search for light from single texels, where the guide of their tile misses it: from hits of the texels beside them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/sobol.h"
#include "scene/light_guide.h"
#include "scene/light_search.h"

namespace beamspread {

class TexelSearch {
public:
    static constexpr std::size_t tile_side = LightSearch::tile_side;

    // `rays`: the largest number of rays of a texel, which those of its searches follow.
    TexelSearch(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed);

    // Finds the guide of a tile, (column, row).
    using FindGuide = std::function<void(std::size_t column, std::size_t row, LightGuide& guide)>;

    // Traces rays from each texel of some tiles by the guides of these tiles. Texels where few arrive search around hits of
    // the texels beside them, until none finds more; these may lie in other tiles. `allowed`, [row * width + column]: true
    // for texels to search from. Too many tiles, or too few rays of a texel: nothing.
    void spread(std::span<const std::size_t> tiles, std::span<const std::uint8_t> allowed, const FindGuide& find_guide,
                const ProbeLight& probe, Progress& progress);

    // True if the guide of the tile misses the light of a texel, and hits of the texel or those beside it are known.
    bool has_guide(std::size_t x, std::size_t y) const;

    // The guide of such a texel.
    void find_guide(std::size_t x, std::size_t y, LightGuide& guide) const;

private:
    // Hits that a texel keeps.
    static constexpr std::size_t max_hits = 8;

    struct Texel {
        std::array<LightHit, max_hits> hits{};
        std::uint8_t count = 0;     // of hits
        std::uint8_t searches = 0;  // from hits beside it
        bool is_lit = false;        // its tile's guide finds light

        void keep(std::span<const LightHit> new_hits);
    };
    using Tile = std::array<Texel, tile_side * tile_side>;

    // Indices of texels, each once.
    struct Texels {
        std::vector<std::size_t> indices;
        std::vector<std::uint8_t> has;  // [texel]

        void add(std::size_t texel);
        std::vector<std::size_t> take();
    };

    const Texel* find(std::size_t x, std::size_t y) const;
    Texel& at(std::size_t x, std::size_t y);
    template <class Visit>
    void visit_around(std::size_t x, std::size_t y, const Visit& visit) const;
    std::vector<LightHit> hits_around(std::size_t x, std::size_t y) const;
    bool is_due(std::size_t texel) const;
    std::vector<std::size_t> take_due(Texels& texels) const;
    void search_tile(std::size_t tile, std::span<const std::uint8_t> allowed, const FindGuide& find_guide,
                     const ProbeLight& probe);
    std::vector<LightHit> search(std::size_t x, std::size_t y, std::size_t index, const LightGuide& guide,
                                 const ProbeLight& probe) const;
    std::vector<LightHit> search_beside(std::size_t x, std::size_t y, const ProbeLight& probe) const;

    std::size_t m_width, m_height, m_columns;
    std::size_t m_search_rays, m_max_searches;  // without either, nothing is searched
    GridSobol m_sobol;
    std::vector<std::unique_ptr<Tile>> m_tiles;  // those with a texel that was searched from
};

}  // namespace beamspread
