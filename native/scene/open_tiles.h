// Tiles of a plane's texels that no occluder can shade, found without rays: by the shadows that all of a light casts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"
#include "scene/shadow_ray.h"

namespace beamspread {

class OpenTiles {
public:
    // No tile is known to be open where the receiver bends, where the light has no corners, or where there are more
    // triangles than texels, since few rays are then traced faster. `tile_side`: in texels.
    OpenTiles(const ReceiverGrid& grid, const Light& light, const Occluders& occluders, const RayStart& start,
              std::size_t tile_side);

    // True if neither the tile of texel (x, y) nor one of its neighbors can be shaded.
    bool is_open(std::size_t x, std::size_t y) const
    {
        return !m_is_open.empty() && m_is_open[y / m_tile_side * m_columns + x / m_tile_side] != 0;
    }

private:
    std::size_t m_tile_side, m_columns;
    std::vector<std::uint8_t> m_is_open;  // [tile]; empty if no tile is open
};

}  // namespace beamspread
