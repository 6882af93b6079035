#include "scene/texel_search.h"

#include <algorithm>
#include <utility>

#include "base/threads.h"

namespace beamspread {

namespace {

// Rays of a search from a texel. More: fewer texels stay dark, in a longer time.
constexpr std::size_t search_rays = 32;

// Rays of these by its tile's guide that arrive, from which a texel keeps that guide.
constexpr std::size_t min_arrived = 8;

// Searches of a texel from hits beside it at most.
constexpr int max_searches = 16;

// Separates the random numbers of a search from those of other rays.
constexpr std::uint32_t search_seed = 0x85ebca6bu;

}  // namespace

// Keeps some of the hits, evenly, as there is room.
void TexelSearch::Texel::keep(std::span<const LightHit> new_hits)
{
    const std::size_t kept = std::min(new_hits.size(), max_hits - count);
    for (std::size_t i = 0; i < kept; ++i)
        hits[count++] = new_hits[i * new_hits.size() / kept];
}

TexelSearch::TexelSearch(std::size_t width, std::size_t height, std::uint32_t seed)
    : m_width(width),
      m_height(height),
      m_columns((width + tile_side - 1) / tile_side),
      m_sobol(search_rays * (max_searches + 1), seed ^ search_seed),
      m_tiles(m_columns * ((height + tile_side - 1) / tile_side))
{
}

const TexelSearch::Texel* TexelSearch::find(std::size_t x, std::size_t y) const
{
    const Tile* tile = m_tiles[y / tile_side * m_columns + x / tile_side].get();
    return tile ? &(*tile)[y % tile_side * tile_side + x % tile_side] : nullptr;
}

TexelSearch::Texel& TexelSearch::at(std::size_t x, std::size_t y)
{
    std::unique_ptr<Tile>& tile = m_tiles[y / tile_side * m_columns + x / tile_side];
    if (!tile)
        tile = std::make_unique<Tile>();
    return (*tile)[y % tile_side * tile_side + x % tile_side];
}

template <class Visit>
void TexelSearch::visit_around(std::size_t x, std::size_t y, const Visit& visit) const
{
    for (std::size_t row = y > 0 ? y - 1 : 0; row <= std::min(y + 1, m_height - 1); ++row)
        for (std::size_t column = x > 0 ? x - 1 : 0; column <= std::min(x + 1, m_width - 1); ++column)
            visit(column, row);
}

std::vector<LightHit> TexelSearch::hits_around(std::size_t x, std::size_t y) const
{
    std::vector<LightHit> hits;
    visit_around(x, y, [&](std::size_t column, std::size_t row) {
        if (const Texel* texel = find(column, row))
            hits.insert(hits.end(), texel->hits.begin(), texel->hits.begin() + texel->count);
    });
    return hits;
}

// Traces rays from a texel by a guide; returns those that arrive. `index`: of the search.
std::vector<LightHit> TexelSearch::search(std::size_t x, std::size_t y, std::size_t index, const LightGuide& guide,
                                          const ProbeLight& probe) const
{
    std::array<Vec2, search_rays> places, positions;
    m_sobol.points(x, y, search_rays * index, search_rays, places.data(), positions.data());
    for (std::size_t i = 0; i < search_rays; ++i) {
        positions[i] += Vec2(static_cast<double>(x), static_cast<double>(y));
        guide.guide(positions[i], places[i]);
    }
    std::array<std::uint8_t, search_rays> arrives;
    probe(positions, places, arrives.data());
    std::vector<LightHit> hits;
    for (std::size_t i = 0; i < search_rays; ++i)
        if (arrives[i])
            hits.push_back({Vec2f(places[i]), Vec2f(positions[i])});
    return hits;
}

void TexelSearch::search_tile(std::size_t tile, std::span<const std::uint8_t> allowed, const FindGuide& find_guide,
                              const ProbeLight& probe)
{
    const std::size_t column = tile % m_columns;
    const std::size_t row = tile / m_columns;
    LightGuide guide;
    find_guide(column, row, guide);
    if (guide.empty())
        return;
    for (std::size_t y = row * tile_side; y < std::min((row + 1) * tile_side, m_height); ++y)
        for (std::size_t x = column * tile_side; x < std::min((column + 1) * tile_side, m_width); ++x) {
            if (!allowed[y * m_width + x])
                continue;
            const std::vector<LightHit> hits = search(x, y, 0, guide, probe);
            Texel& texel = at(x, y);
            texel.is_lit = hits.size() >= min_arrived;
            texel.keep(hits);
        }
}

// Empties a list of texels; returns each once, if hits beside it may help it.
std::vector<std::size_t> TexelSearch::take_due(std::vector<std::size_t>& texels) const
{
    std::vector<std::size_t> due = std::exchange(texels, {});
    std::ranges::sort(due);
    const auto same = std::ranges::unique(due);
    due.erase(same.begin(), same.end());
    std::erase_if(due, [this](std::size_t i) {
        const Texel* texel = find(i % m_width, i / m_width);
        return texel && (texel->is_lit || texel->count == max_hits || texel->searches == max_searches);
    });
    return due;
}

std::vector<LightHit> TexelSearch::search_beside(std::size_t x, std::size_t y, const ProbeLight& probe) const
{
    const Texel* texel = find(x, y);
    LightGuide guide;
    find_guide(x, y, guide);
    return search(x, y, 1 + (texel ? texel->searches : 0), guide, probe);
}

void TexelSearch::spread(std::span<const std::size_t> tiles, std::span<const std::uint8_t> allowed,
                         const FindGuide& find_guide, const ProbeLight& probe)
{
    parallel_for(tiles.size(), [&](std::size_t i) { search_tile(tiles[i], allowed, find_guide, probe); });
    std::vector<std::size_t> beside;  // texels beside news
    const auto add_beside = [&](std::size_t texel) {
        visit_around(texel % m_width, texel / m_width, [&](std::size_t x, std::size_t y) {
            if (allowed[y * m_width + x])
                beside.push_back(y * m_width + x);
        });
    };
    for (std::size_t i = 0; i < allowed.size(); ++i)
        if (const Texel* texel = find(i % m_width, i / m_width); texel && texel->count > 0)
            add_beside(i);
    // Texels that have found nothing try again once those around them know all that they can find.
    std::vector<std::size_t> dark;
    while (true) {
        std::vector<std::size_t> due = take_due(beside);
        if (due.empty())
            due = take_due(dark);
        if (due.empty())
            return;
        std::vector<std::vector<LightHit>> hits(due.size());
        parallel_for(due.size(),
                     [&](std::size_t k) { hits[k] = search_beside(due[k] % m_width, due[k] / m_width, probe); });
        for (std::size_t k = 0; k < due.size(); ++k) {
            Texel& texel = at(due[k] % m_width, due[k] / m_width);
            ++texel.searches;
            texel.keep(hits[k]);
            if (!hits[k].empty())
                add_beside(due[k]);
            else if (texel.count == 0)
                dark.push_back(due[k]);
        }
    }
}

bool TexelSearch::has_guide(std::size_t x, std::size_t y) const
{
    const Texel* texel = find(x, y);
    return texel && !texel->is_lit && !hits_around(x, y).empty();
}

void TexelSearch::find_guide(std::size_t x, std::size_t y, LightGuide& guide) const
{
    std::vector<LightHit> hits = hits_around(x, y);
    guide.assign(hits);
}

}  // namespace beamspread
