// Tiles of a mesh that bends around which a lamp without a size shines on all points, or on none: few rays tell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"
#include "scene/shadow_ray.h"
#include "scene/shadows.h"

namespace beamspread {

class EvenTiles {
public:
    // No tile is known yet.
    EvenTiles() = default;

    // Traces two rays from each texel, from some of its `places` in the unit square.
    EvenTiles(const ReceiverGrid& grid, const Light& light, const Occluders& occluders, const ReceiverRays& rays,
              std::span<const Vec2> places);

    // Whether all rays, or none, of the texel's tile and its neighbors get through. What blocks a part of the light there
    // and no ray, at places that are not related to the texels', covers less than a thousandth of them on average.
    Shade shade(std::size_t x, std::size_t y) const
    {
        return m_shades.empty() ? Shade::unknown : m_shades[y / tile_side * m_columns + x / tile_side];
    }

private:
    // Side of a tile, texels. Larger: thinner obstacles are seen, and more rays are traced along borders of shadows.
    static constexpr std::size_t tile_side = 8;

    // Rays of a tile, and how many get through.
    struct Tile {
        std::uint32_t rays = 0;
        std::uint32_t lit = 0;
        std::uint32_t dark = 0;
    };

    static Tile trace(const ReceiverGrid& grid, const Light& light, const Occluders& occluders,
                      const ReceiverRays& rays, std::span<const Vec2> places, std::size_t left, std::size_t bottom);

    std::size_t m_columns = 0;
    std::vector<Shade> m_shades;  // [tile]
};

}  // namespace beamspread
