#include "scene/even_tiles.h"

#include <algorithm>
#include <array>

#include "base/random.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Places of each texel whose rays are traced.
constexpr std::size_t first_rays = 2;

// Rays of a tile and its neighbors, at least, which tell how the others go. If a fraction f of the light is blocked, all of
// n rays miss that with a probability of exp(-n f): f exp(-n f) is at most 1 / (e n). Larger: less light is lost or won,
// more rays where the islands of the map are small.
constexpr std::uint32_t least_rays = 512;

// Places of a texel: in no order over the texels, so that no obstacle can lie between all of them.
std::array<std::size_t, first_rays> chosen(std::size_t texel, std::size_t count)
{
    std::uint64_t state = texel;
    const std::uint64_t word = split_mix(state);
    const std::size_t first = word % count;
    const std::size_t step = 1 + (word >> 32) % (count - 1);
    return {first, (first + step) % count};
}

// A ray that is traced once more if it is blocked: faces that bend cut off the ends of many texels.
struct Start {
    std::size_t texel;
    Vec3 point;
    LightRay to_light;
};

}  // namespace

EvenTiles::Tile EvenTiles::trace(const ReceiverGrid& grid, const Light& light, const Occluders& occluders,
                                 const ReceiverRays& rays, std::span<const Vec2> places, std::size_t left,
                                 std::size_t bottom)
{
    Tile tile;
    std::array<Start, Occluders::packet_size> starts;
    std::array<ShadowRay, Occluders::packet_size> packet;
    std::array<Vec3f, Occluders::packet_size> transmittance;
    std::size_t waiting = 0;
    const auto flush = [&] {
        occluders.transmit(std::span(packet).first(waiting), transmittance.data());
        std::size_t blocked = 0;
        for (std::size_t i = 0; i < waiting; ++i) {
            if (transmittance[i] == Vec3f(1.0f))
                ++tile.lit;
            else
                packet[blocked++] = rays.shadow_ray(starts[i].texel, starts[i].point, starts[i].to_light);
        }
        occluders.transmit(std::span(packet).first(blocked), transmittance.data());
        for (std::size_t i = 0; i < blocked; ++i) {
            tile.lit += transmittance[i] != Vec3f(0.0f) ? 1 : 0;
            tile.dark += transmittance[i] != Vec3f(1.0f) ? 1 : 0;
        }
        waiting = 0;
    };
    for (std::size_t y = bottom; y < std::min(bottom + tile_side, grid.height); ++y)
        for (std::size_t x = left; x < std::min(left + tile_side, grid.width); ++x) {
            const std::size_t texel = y * grid.width + x;
            const BentTexel& of_mesh = grid.bent_texel(texel);
            if (!of_mesh.is_inside())
                continue;
            tile.rays += first_rays;
            std::array<Vec3, first_rays> points;
            std::ranges::transform(chosen(texel, places.size()), points.begin(),
                                   [&](std::size_t place) { return of_mesh.point(places[place].x, places[place].y); });
            std::array<LightRay, first_rays> to_light;
            light.sample(points, grid.normal_at(texel), {}, to_light.data());
            for (std::size_t i = 0; i < first_rays; ++i) {
                if (rays.is_behind_face(texel, to_light[i]) || !(to_light[i].flux.x > 0.0f) ||
                    !(rays.arriving_cosine(texel, to_light[i]) > 0.0)) {
                    ++tile.dark;
                    continue;
                }
                starts[waiting] = {texel, points[i], to_light[i]};
                packet[waiting] = rays.first_ray(texel, points[i], to_light[i]);
                if (++waiting == packet.size())
                    flush();
            }
            // Texels along a border of a shadow need no more rays here.
            if (tile.lit > 0 && tile.dark > 0)
                return tile;
        }
    flush();
    return tile;
}

EvenTiles::EvenTiles(const ReceiverGrid& grid, const Light& light, const Occluders& occluders, const ReceiverRays& rays,
                     std::span<const Vec2> places)
    : m_columns((grid.width + tile_side - 1) / tile_side)
{
    const std::size_t rows = (grid.height + tile_side - 1) / tile_side;
    std::vector<Tile> tiles(m_columns * rows);
    parallel_for(rows, [&](std::size_t row) {
        for (std::size_t column = 0; column < m_columns; ++column)
            tiles[row * m_columns + column] =
                trace(grid, light, occluders, rays, places, column * tile_side, row * tile_side);
    });
    m_shades.assign(tiles.size(), Shade::unknown);
    for (std::size_t row = 0; row < rows; ++row)
        for (std::size_t column = 0; column < m_columns; ++column) {
            Tile around;
            for (std::size_t y = row - std::min<std::size_t>(row, 1); y < std::min(row + 2, rows); ++y)
                for (std::size_t x = column - std::min<std::size_t>(column, 1); x < std::min(column + 2, m_columns);
                     ++x) {
                    const Tile& tile = tiles[y * m_columns + x];
                    around.rays += tile.rays;
                    around.lit += tile.lit;
                    around.dark += tile.dark;
                }
            if (around.rays >= least_rays && (around.lit == 0 || around.dark == 0))
                m_shades[row * m_columns + column] = around.lit == 0 ? Shade::full : Shade::none;
        }
}

}  // namespace beamspread
