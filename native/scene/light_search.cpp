#include "scene/light_search.h"

#include <algorithm>

#include "base/threads.h"

namespace beamspread {

namespace {

// Rays of a search from a tile for each ray of a texel, and bounds of their number. More: light that is harder to find.
constexpr std::size_t search_rays_per_ray = 4;
constexpr std::size_t min_search_rays = 64;
constexpr std::size_t max_search_rays = 1024;

// Searches of a tile at most, if the last one has found many hits, and if the first pass has. More: guides that fit better,
// in a longer time.
constexpr int max_searches = 16;
constexpr int max_full_searches = 2;
constexpr int max_lit_searches = 1;

// Hits that a tile keeps of the first pass and in all, and that it takes from each neighbor. More: guides that fit better,
// and take longer.
constexpr std::size_t first_hits = 32;
constexpr std::size_t max_hits = 128;
constexpr std::size_t hits_of_neighbor = 16;

// Fraction of rays of the first pass that get through, above which even rays have less noise than guided ones.
constexpr double max_rare_share = 0.2;

// Tiles are hard if less than this fraction of the rays of their last search, and fewer than `first_hits` of their first
// pass, have found light, and if this fraction of the light of all lit tiles arrives there or beside them. More and less:
// fewer dark texels, in a longer time.
constexpr double max_hard_share = 0.3;
constexpr double min_hard_brightness = 0.1;

// Separates the random numbers of a search from those of other rays.
constexpr std::uint32_t search_seed = 0x9e3779b9u;

}  // namespace

bool LightSearch::Tile::is_rare() const
{
    return static_cast<double>(arrived) < max_rare_share * static_cast<double>(traced);
}

bool LightSearch::Tile::is_hard(std::size_t search_rays) const
{
    return searches > 0 && arrived < first_hits &&
           static_cast<double>(found) < max_hard_share * static_cast<double>(search_rays);
}

// Keeps hits until there are enough; later ones replace as many as a row's share.
void LightSearch::Tile::keep_first(std::span<const LightHit> new_hits)
{
    const std::size_t room = std::max(first_hits - hits.size(), first_hits / tile_side);
    const std::size_t kept = std::min(new_hits.size(), room);
    for (std::size_t i = 0; i < kept; ++i) {
        const LightHit& hit = new_hits[i * new_hits.size() / kept];
        if (hits.size() < first_hits)
            hits.push_back(hit);
        else
            hits[replaced++ % first_hits] = hit;
    }
}

// Keeps some of the hits, evenly.
void LightSearch::Tile::keep(std::span<const LightHit> new_hits)
{
    const std::size_t kept = std::min(new_hits.size(), max_hits);
    if (kept == max_hits)
        hits.clear();
    for (std::size_t i = 0; i < kept; ++i) {
        const LightHit& hit = new_hits[i * new_hits.size() / kept];
        if (hits.size() < max_hits)
            hits.push_back(hit);
        else
            hits[i] = hit;
    }
}

LightSearch::LightSearch(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed)
    : m_width(width),
      m_height(height),
      m_columns((width + tile_side - 1) / tile_side),
      m_rows((height + tile_side - 1) / tile_side),
      m_search_rays(std::clamp(search_rays_per_ray * rays, min_search_rays, max_search_rays)),
      m_sobol(m_search_rays * max_searches, seed ^ search_seed),
      m_tiles(m_columns * m_rows)
{
}

void LightSearch::note(std::size_t x, std::size_t y, const FirstRays& rays, std::span<const LightHit> hits)
{
    Tile& tile = m_tiles[y / tile_side * m_columns + x / tile_side];
    const std::size_t columns = std::min(tile_side, m_width - x / tile_side * tile_side);
    const std::size_t rows = std::min(tile_side, m_height - y / tile_side * tile_side);
    const auto texels = static_cast<double>(columns * rows);
    tile.traced += rays.traced;
    tile.arrived += hits.size();
    tile.open += static_cast<double>(rays.open) / texels;
    tile.irradiance += static_cast<double>(rays.irradiance) / texels;
    tile.keep_first(hits);
    tile.has_news |= !hits.empty();
}

template <class Visit>
void LightSearch::visit_around(std::size_t tile, const Visit& visit) const
{
    const std::size_t x = tile % m_columns;
    const std::size_t y = tile / m_columns;
    for (std::size_t row = y > 0 ? y - 1 : 0; row <= std::min(y + 1, m_rows - 1); ++row)
        for (std::size_t column = x > 0 ? x - 1 : 0; column <= std::min(x + 1, m_columns - 1); ++column)
            visit(row * m_columns + column);
}

std::vector<LightHit> LightSearch::hits_around(std::size_t tile) const
{
    std::vector<LightHit> hits = m_tiles[tile].hits;
    const std::size_t column = tile % m_columns;
    const std::size_t row = tile / m_columns;
    const Vec2f center =
        static_cast<float>(tile_side) * Vec2f(static_cast<float>(column) + 0.5f, static_cast<float>(row) + 0.5f);
    const auto distance = [&center](const LightHit& hit) {
        const Vec2f step = glm::abs(hit.position - center);
        return std::max(step.x, step.y);
    };
    std::vector<LightHit> nearest;
    visit_around(tile, [&](std::size_t i) {
        if (i == tile)
            return;
        nearest = m_tiles[i].hits;
        const std::size_t count = std::min(nearest.size(), hits_of_neighbor);
        const auto end = nearest.begin() + static_cast<std::ptrdiff_t>(count);
        std::ranges::nth_element(nearest, end, {}, distance);
        hits.insert(hits.end(), nearest.begin(), end);
    });
    return hits;
}

int LightSearch::max_searches_of(const Tile& tile)
{
    if (tile.arrived >= first_hits)
        return max_lit_searches;
    return tile.hits.size() == max_hits ? max_full_searches : max_searches;
}

bool LightSearch::is_due(std::size_t tile) const
{
    if (!m_tiles[tile].is_rare() || m_tiles[tile].searches >= max_searches_of(m_tiles[tile]))
        return false;
    bool has_news = false;
    visit_around(tile, [&](std::size_t i) { has_news |= m_tiles[i].has_news; });
    return has_news;
}

LightSearch::Found LightSearch::search(std::size_t tile, const ProbeLight& probe) const
{
    LightGuide guide;
    std::vector<LightHit> hits = hits_around(tile);
    guide.assign(hits);
    std::vector<Vec2> places(m_search_rays), positions(m_search_rays);
    std::vector<double> densities(m_search_rays);
    const std::size_t x = tile % m_columns;
    const std::size_t y = tile / m_columns;
    const std::size_t first = m_search_rays * static_cast<std::size_t>(m_tiles[tile].searches);
    m_sobol.points(x, y, first, m_search_rays, places.data(), positions.data());
    const Vec2 begin(static_cast<double>(x * tile_side), static_cast<double>(y * tile_side));
    const Vec2 end(static_cast<double>(std::min((x + 1) * tile_side, m_width)),
                   static_cast<double>(std::min((y + 1) * tile_side, m_height)));
    for (std::size_t i = 0; i < m_search_rays; ++i) {
        // Every other ray starts as near to a hit as the tile allows: from farther away a narrow gap may lie in another
        // direction.
        const Vec2 beside = Vec2(hits[i / 2 % hits.size()].position) + 2.0 * positions[i] - 1.0;
        positions[i] = i % 2 == 1 ? glm::clamp(beside, begin, end) : glm::mix(begin, end, positions[i]);
        densities[i] = guide.guide(positions[i], places[i]);
    }
    std::vector<std::uint8_t> arrives(m_search_rays);
    probe(positions, places, arrives.data());
    hits.clear();
    std::vector<double> ends;
    double total = 0.0;
    for (std::size_t i = 0; i < m_search_rays; ++i)
        if (arrives[i]) {
            hits.push_back({Vec2f(places[i]), Vec2f(positions[i])});
            ends.push_back(total += 1.0 / densities[i]);
        }
    if (hits.size() <= max_hits)
        return {hits, hits.size(), total / static_cast<double>(m_search_rays)};
    std::vector<LightHit> kept;
    for (std::size_t i = 0, k = 0; i < max_hits; ++i) {
        const double at = (static_cast<double>(i) + 0.5) / max_hits * total;
        while (ends[k] < at)
            ++k;
        kept.push_back(hits[k]);
    }
    return {kept, hits.size(), total / static_cast<double>(m_search_rays)};
}

void LightSearch::spread(const ProbeLight& probe, Progress& progress)
{
    find_mean();
    while (true) {
        std::vector<std::size_t> due;
        for (std::size_t i = 0; i < m_tiles.size(); ++i)
            if (is_due(i))
                due.push_back(i);
        if (due.empty())
            return;
        std::vector<Found> found(due.size());
        parallel_for(due.size(), [&](std::size_t k) {
            found[k] = search(due[k], probe);
            progress.advance(0.0);
        });
        for (Tile& tile : m_tiles)
            tile.has_news = false;
        for (std::size_t k = 0; k < due.size(); ++k) {
            Tile& tile = m_tiles[due[k]];
            ++tile.searches;
            tile.found = found[k].count;
            tile.visible = found[k].visible;
            tile.has_news = found[k].count > 0;
            tile.keep(found[k].hits);
        }
    }
}

void LightSearch::find_mean()
{
    double sum = 0.0;
    std::size_t lit = 0;
    for (const Tile& tile : m_tiles)
        if (tile.irradiance > 0.0) {
            sum += tile.irradiance;
            ++lit;
        }
    if (lit > 0)
        m_mean = sum / static_cast<double>(lit);
}

std::vector<std::size_t> LightSearch::find_hard_tiles() const
{
    double open = 0.0, irradiance = 0.0;
    std::size_t lit = 0;
    for (const Tile& tile : m_tiles) {
        open += tile.open;
        irradiance += tile.irradiance;
        lit += !tile.hits.empty();
    }
    if (lit == 0 || irradiance >= max_rare_share * open)
        return {};
    const double wanted = min_hard_brightness * irradiance / static_cast<double>(lit);
    std::vector<std::uint8_t> is_hard(m_tiles.size());
    for (std::size_t i = 0; i < m_tiles.size(); ++i) {
        if (!m_tiles[i].is_hard(m_search_rays))
            continue;
        // A tile may have found little for want of a guide, so those beside it count as well.
        double brightest = 0.0;
        visit_around(i, [&](std::size_t k) { brightest = std::max(brightest, m_tiles[k].brightness()); });
        if (brightest >= wanted)
            visit_around(i, [&](std::size_t k) { is_hard[k] = true; });
    }
    std::vector<std::size_t> tiles;
    for (std::size_t i = 0; i < m_tiles.size(); ++i)
        if (is_hard[i] && has_hits_around(i % m_columns * tile_side, i / m_columns * tile_side))
            tiles.push_back(i);
    return tiles;
}

bool LightSearch::has_hits_around(std::size_t x, std::size_t y) const
{
    bool has_hits = false;
    visit_around(y / tile_side * m_columns + x / tile_side,
                 [&](std::size_t i) { has_hits |= !m_tiles[i].hits.empty(); });
    return has_hits;
}

void LightSearch::find_guide(std::size_t x, std::size_t y, LightGuide& guide) const
{
    std::vector<LightHit> hits = hits_around(y / tile_side * m_columns + x / tile_side);
    guide.assign(hits);
}

}  // namespace beamspread
