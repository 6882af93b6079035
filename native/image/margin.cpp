#include "image/margin.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace beamspread {

namespace {

// States of a texel. Known ones have an odd state.
constexpr std::uint8_t unknown = 0;
constexpr std::uint8_t known_state = 1;
constexpr std::uint8_t queued = 2;
constexpr std::uint8_t of_frame = 4;

// Number of no island, above all others.
constexpr std::int32_t no_island = std::numeric_limits<std::int32_t>::max();

// Positions of the straight neighbors among all, row by row; the others are diagonal.
constexpr std::array<std::size_t, 4> straight = {1, 3, 4, 6};
constexpr std::array<std::size_t, 4> diagonal = {0, 2, 5, 7};

}  // namespace

Rings::Rings(const Texture& texture, const std::int32_t* islands)
    : m_texture(texture), m_islands(islands), m_stride(texture.width + 2)
{
    const auto neighbors = [](std::size_t row) {
        const auto width = static_cast<std::ptrdiff_t>(row);
        return std::array{-width - 1,        -width,    -width + 1, std::ptrdiff_t{-1},
                          std::ptrdiff_t{1}, width - 1, width,      width + 1};
    };
    m_neighbors = neighbors(m_stride);
    m_texels = neighbors(texture.width);
}

void Rings::add(const std::uint8_t* known, std::size_t count, Filled* all)
{
    start(known);
    const std::size_t channels = m_texture.channels;
    std::vector<Framed> ring = first_ring();
    std::vector<std::pair<Framed, std::int32_t>> found;  // and their islands
    std::vector<float> means;                            // [found][channel]
    for (std::size_t i = 0; i < count && !ring.empty(); ++i) {
        found.clear();
        means.resize(ring.size() * channels);
        for (const Framed framed : ring) {
            const std::int32_t island = island_to_continue(framed);
            if (add_up(framed, island, means.data() + found.size() * channels))
                found.emplace_back(framed, island);
        }
        for (const Framed framed : ring)
            m_states[framed] = unknown;
        for (std::size_t k = 0; k < found.size(); ++k) {
            const auto& [framed, island] = found[k];
            float* const values = m_texture.values + texel(framed) * channels;
            if (all) {
                all->texels.push_back(texel(framed));
                all->before.insert(all->before.end(), values, values + channels);
            }
            for (std::size_t c = 0; c < channels; ++c)
                values[c] = means[k * channels + c];
            m_states[framed] = known_state;
            if (!m_continued.empty())
                m_continued[framed] = island;
        }
        ring = beside(ring);
    }
}

void Rings::start(const std::uint8_t* known)
{
    const auto [values, height, width, channels] = m_texture;
    m_states.assign(m_stride * (height + 2), of_frame);
    if (m_islands && m_continued.empty())
        m_continued.resize(m_states.size());
    for (std::size_t y = 0; y < height; ++y) {
        const std::size_t first = (y + 1) * m_stride + 1;
        std::copy_n(known + y * width, width, m_states.data() + first);
        if (m_islands)
            std::transform(m_islands + y * width, m_islands + (y + 1) * width, m_continued.data() + first,
                           [](std::int32_t island) { return island < 0 ? no_island : island; });
    }
}

// Unknown texels beside known ones.
std::vector<Rings::Framed> Rings::first_ring() const
{
    const auto [values, height, width, channels] = m_texture;
    std::vector<std::uint8_t> above(m_stride);  // 1 where a texel of three rows is known
    std::vector<std::uint8_t> is_beside(width);
    std::vector<Framed> ring;
    for (std::size_t y = 1; y <= height; ++y) {
        const std::uint8_t* row = m_states.data() + y * m_stride;
        for (std::size_t x = 0; x < m_stride; ++x)
            above[x] = (row[x - m_stride] | row[x] | row[x + m_stride]) & known_state;
        for (std::size_t x = 0; x < width; ++x)
            is_beside[x] = (above[x] | above[x + 1] | above[x + 2]) & ~row[x + 1];
        for (auto next = is_beside.begin(); (next = std::find(next, is_beside.end(), 1)) != is_beside.end(); ++next)
            ring.push_back(y * m_stride + 1 + static_cast<std::size_t>(next - is_beside.begin()));
    }
    return ring;
}

// Unknown texels beside those of a ring, which become queued.
std::vector<Rings::Framed> Rings::beside(const std::vector<Framed>& ring)
{
    std::vector<Framed> next;
    for (const Framed framed : ring)
        for (const std::ptrdiff_t step : m_neighbors) {
            const Framed other = framed + static_cast<std::size_t>(step);
            if (m_states[other] != unknown)
                continue;
            m_states[other] = queued;
            next.push_back(other);
        }
    return next;
}

std::int32_t Rings::island_to_continue(Framed framed) const
{
    if (m_continued.empty())
        return no_island;
    std::int32_t island = m_continued[framed];
    for (const auto& some : {straight, diagonal})
        if (island == no_island)
            for (const std::size_t i : some) {
                const Framed other = framed + static_cast<std::size_t>(m_neighbors[i]);
                if (m_states[other] == known_state)
                    island = std::min(island, m_continued[other]);
            }
    return island;
}

// False if no texel of the island is known beside it.
bool Rings::add_up(Framed framed, std::int32_t island, float* mean) const
{
    const std::size_t channels = m_texture.channels;
    const float* const own = m_texture.values + texel(framed) * channels;
    float count = 0.0f;
    std::fill_n(mean, channels, 0.0f);
    for (std::size_t i = 0; i < m_neighbors.size(); ++i) {
        const Framed other = framed + static_cast<std::size_t>(m_neighbors[i]);
        if (m_states[other] != known_state || (!m_continued.empty() && m_continued[other] != island))
            continue;
        count += 1.0f;
        const float* const from = own + m_texels[i] * static_cast<std::ptrdiff_t>(channels);
        for (std::size_t c = 0; c < channels; ++c)
            mean[c] += from[c];
    }
    for (std::size_t c = 0; c < channels && count > 0.0f; ++c)
        mean[c] /= count;
    return count > 0.0f;
}

namespace {

// Gives some of the filled texels their values back.
template <class Predicate>
void restore(const Texture& texture, const Rings::Filled& filled, const Predicate& is_restored)
{
    for (std::size_t i = 0; i < filled.texels.size(); ++i)
        if (is_restored(filled.texels[i]))
            std::copy_n(filled.before.data() + i * texture.channels, texture.channels,
                        texture.values + filled.texels[i] * texture.channels);
}

}  // namespace

void extend_margin(const Texture& texture, const float* coverage, const std::int32_t* islands, std::size_t margin,
                   float whole, std::size_t border)
{
    const auto above = [&](float limit) {
        std::vector<std::uint8_t> mask(texture.texels());
        std::transform(coverage, coverage + mask.size(), mask.begin(),
                       [limit](float part) { return static_cast<std::uint8_t>(part > limit); });
        return mask;
    };
    Rings rings(texture, islands);
    const std::vector<std::uint8_t> baked = above(0.0f);
    Rings::Filled cut;  // baked texels, continued for their rings alone
    if (const std::vector<std::uint8_t> is_whole = above(whole); is_whole != baked) {
        rings.add(is_whole.data(), border, &cut);
        restore(texture, cut, [&](std::size_t texel) { return !baked[texel]; });
    }
    rings.add(baked.data(), margin);
    restore(texture, cut, [&](std::size_t texel) { return baked[texel]; });
}

}  // namespace beamspread
