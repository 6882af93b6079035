#include "scene/texel_search.h"

#include <algorithm>
#include <utility>

#include "base/threads.h"

namespace beamspread {

namespace {

// Rays of a search from a texel, for each of its rays, and bounds of their number. A texel of which the lower bound would
// be more does not search. More: fewer texels stay dark, in a longer time.
constexpr double search_rays_per_ray = 1.0 / 8.0;
constexpr std::size_t min_search_rays = 8;
constexpr std::size_t max_search_rays = 32;

// Fraction of the rays of a search that arrive by a tile's guide, from which a texel keeps that guide. More: less noise, in
// a longer time.
constexpr double min_arrived = 0.25;

// Searches of a texel from hits beside it, for each of its rays, and their largest number. More: fewer texels stay dark, in
// a longer time.
constexpr double searches_per_ray = 1.0 / 32.0;
constexpr std::size_t max_searches = 16;

// Texels of hard tiles at most, 140 bytes each. Larger images have fewer hard tiles: their tiles are smaller.
constexpr std::size_t max_texels = 1 << 20;

// Texels that search at once. More: more memory.
constexpr std::size_t texels_at_once = 1 << 14;

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

TexelSearch::TexelSearch(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed)
    : m_width(width),
      m_height(height),
      m_columns((width + tile_side - 1) / tile_side),
      m_search_rays(
          std::min(static_cast<std::size_t>(search_rays_per_ray * static_cast<double>(rays)), max_search_rays)),
      m_max_searches(std::min(static_cast<std::size_t>(searches_per_ray * static_cast<double>(rays)), max_searches)),
      m_sobol(std::max<std::size_t>(m_search_rays * (m_max_searches + 1), 1), seed ^ search_seed),
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
    std::array<Vec2, max_search_rays> places, positions;
    m_sobol.points(x, y, m_search_rays * index, m_search_rays, places.data(), positions.data());
    for (std::size_t i = 0; i < m_search_rays; ++i) {
        positions[i] += Vec2(static_cast<double>(x), static_cast<double>(y));
        guide.guide(positions[i], places[i]);
    }
    std::array<std::uint8_t, max_search_rays> arrives;
    probe(std::span(positions).first(m_search_rays), std::span(places).first(m_search_rays), arrives.data());
    std::vector<LightHit> hits;
    for (std::size_t i = 0; i < m_search_rays; ++i)
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
            texel.is_lit = static_cast<double>(hits.size()) >= min_arrived * static_cast<double>(m_search_rays);
            texel.keep(hits);
        }
}

void TexelSearch::Texels::add(std::size_t texel)
{
    if (!has[texel])
        indices.push_back(texel);
    has[texel] = true;
}

std::vector<std::size_t> TexelSearch::Texels::take()
{
    for (const std::size_t texel : indices)
        has[texel] = false;
    return std::exchange(indices, {});
}

// True if hits beside a texel may help it.
bool TexelSearch::is_due(std::size_t texel) const
{
    const Texel* known = find(texel % m_width, texel / m_width);
    return !known || (!known->is_lit && known->count < max_hits && known->searches < m_max_searches);
}

// Takes all texels; returns those that are due, in order.
std::vector<std::size_t> TexelSearch::take_due(Texels& texels) const
{
    std::vector<std::size_t> due = texels.take();
    std::erase_if(due, [this](std::size_t texel) { return !is_due(texel); });
    std::ranges::sort(due);
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
                         const FindGuide& find_guide, const ProbeLight& probe, Progress& progress)
{
    if (m_search_rays < min_search_rays || tiles.size() * tile_side * tile_side > max_texels)
        return;
    parallel_for(tiles.size(), [&](std::size_t i) {
        search_tile(tiles[i], allowed, find_guide, probe);
        progress.advance(0.0);
    });
    Texels beside{.indices = {},
                  .has = std::vector<std::uint8_t>(allowed.size())};  // texels that have news beside them
    Texels dark = beside;  // texels that have found nothing
    const auto add_beside = [&](std::size_t texel) {
        visit_around(texel % m_width, texel / m_width, [&](std::size_t x, std::size_t y) {
            if (allowed[y * m_width + x])
                beside.add(y * m_width + x);
        });
    };
    for (std::size_t i = 0; i < allowed.size(); ++i)
        if (const Texel* texel = find(i % m_width, i / m_width); texel && texel->count > 0)
            add_beside(i);
    while (true) {
        std::vector<std::size_t> due = take_due(beside);
        // Texels that have found nothing try again once those around them know all that they can find.
        if (due.empty())
            due = take_due(dark);
        if (due.empty())
            return;
        for (std::size_t first = 0; first < due.size(); first += texels_at_once) {
            const std::span some = std::span(due).subspan(first, std::min(texels_at_once, due.size() - first));
            std::vector<std::vector<LightHit>> hits(some.size());
            parallel_for(some.size(), [&](std::size_t k) {
                hits[k] = search_beside(some[k] % m_width, some[k] / m_width, probe);
                progress.advance(0.0);
            });
            for (std::size_t k = 0; k < some.size(); ++k) {
                Texel& texel = at(some[k] % m_width, some[k] / m_width);
                ++texel.searches;
                texel.keep(hits[k]);
                if (!hits[k].empty())
                    add_beside(some[k]);
                else if (texel.count == 0)
                    dark.add(some[k]);
            }
        }
    }
}

bool TexelSearch::has_guide(std::size_t x, std::size_t y) const
{
    const Texel* texel = find(x, y);
    if (!texel || texel->is_lit)
        return false;
    bool has_hits = false;
    visit_around(x, y, [&](std::size_t column, std::size_t row) {
        const Texel* beside = find(column, row);
        has_hits |= beside && beside->count > 0;
    });
    return has_hits;
}

void TexelSearch::find_guide(std::size_t x, std::size_t y, LightGuide& guide) const
{
    std::vector<LightHit> hits = hits_around(x, y);
    guide.assign(hits);
}

}  // namespace beamspread
