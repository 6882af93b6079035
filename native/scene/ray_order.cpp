#include "scene/ray_order.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "scene/occluders.h"

namespace beamspread {

namespace {

// Parts along a side of a light by which the rays of a texel are sorted. More: rays of a packet meet more of the same
// triangles, and sorting takes longer.
constexpr std::size_t light_parts = 8;

std::size_t part_of(double place)
{
    return std::min(static_cast<std::size_t>(place * static_cast<double>(light_parts)), light_parts - 1);
}

}  // namespace

void RayOrder::sort(std::span<const Vec2> on_light)
{
    m_order.resize(on_light.size());
    if (on_light.size() < 2 * Occluders::packet_size) {
        std::iota(m_order.begin(), m_order.end(), std::uint16_t{0});
        return;
    }
    constexpr std::array<std::uint8_t, light_parts> spread = {0, 1, 4, 5, 16, 17, 20, 21};  // of a Morton curve
    m_parts.resize(on_light.size());
    std::array<std::uint16_t, light_parts * light_parts + 1> ends{};
    for (std::size_t i = 0; i < on_light.size(); ++i) {
        m_parts[i] = static_cast<std::uint8_t>(spread[part_of(on_light[i].x)] + 2 * spread[part_of(on_light[i].y)]);
        ++ends[m_parts[i] + 1u];
    }
    for (std::size_t i = 1; i < ends.size(); ++i)
        ends[i] = static_cast<std::uint16_t>(ends[i] + ends[i - 1]);
    for (std::size_t i = 0; i < on_light.size(); ++i)
        m_order[ends[m_parts[i]]++] = static_cast<std::uint16_t>(i);
}

}  // namespace beamspread
