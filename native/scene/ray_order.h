// The order in which the rays of a texel are traced.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// Rays to the same part of a light are traced together: they meet the same triangles.
class RayOrder {
public:
    // `on_light`: places of the unit square.
    void sort(std::span<const Vec2> on_light);

    std::size_t operator[](std::size_t i) const { return m_order[i]; }

private:
    std::vector<std::uint8_t> m_parts;  // [ray] of the light
    std::vector<std::uint16_t> m_order;
};

}  // namespace beamspread
