// The parts of a receiver that no occluder can shade, found without rays.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/lights.h"
#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

// Shadow rays start this far off the plane.
struct RayStart {
    double rounding = 0.0;  // bound of the rounding of a ray and of what it meets, metres
    double clearance = 0.0;

    double height() const { return rounding + clearance; }
};

// A texel is open where the shadow of no triangle reaches its tile of texels, each shadow taken as the rectangle around
// it. Rays from an open texel are blocked by nothing, so they need not be traced.
class OpenTiles {
public:
    // `occluders` may be null: everything is open.
    OpenTiles(const ReceiverGrid& grid, const LightSource& source, const Occluders* occluders, const RayStart& start);

    bool is_open(std::size_t x, std::size_t y) const
    {
        return m_shaded.empty() || m_shaded[y / tile_side * m_columns + x / tile_side] == 0;
    }

private:
    static constexpr std::size_t tile_side = 16;

    void shade(Vec2 low, Vec2 high);

    std::size_t m_columns;
    std::size_t m_rows;
    std::vector<std::uint8_t> m_shaded;
};

}  // namespace beamspread
