#include "scene/passage.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

// Units of depth in which light halves: fine enough for depths of few crossings to be exact in single precision.
constexpr double units_per_half = 1099511627776.0;  // 2^40

// Less than 2^-24 is nothing beside what single precision can tell from 1.
constexpr auto most_depth = static_cast<std::int64_t>(24.0 * units_per_half);

// Distances of one ray to one place differ by the rounding of single precision, which this is far above. Ten times as much
// and a tenth pass the same tests.
constexpr float same_place = 1e-5f;

std::int64_t depth_of(float transmittance)
{
    if (!(transmittance > 0.0f))
        return most_depth;
    const double depth = -std::log2(static_cast<double>(transmittance)) * units_per_half;
    return std::llround(std::clamp(depth, 0.0, static_cast<double>(most_depth)));
}

}  // namespace

bool Passage::cross(const Vec3f& transmittance, float distance, bool at_edge)
{
    const Depth depth = {depth_of(transmittance.x), depth_of(transmittance.y), depth_of(transmittance.z)};
    Depth* counted = at_edge ? edge_at(distance) : nullptr;
    m_crossings += counted ? 0 : 1;
    bool is_dark = true;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        m_depth[i] += counted ? std::max<std::int64_t>(depth[i] - (*counted)[i], 0) : depth[i];
        if (counted)
            (*counted)[i] = std::max((*counted)[i], depth[i]);
        is_dark &= m_depth[i] >= most_depth;
    }
    if (at_edge && !counted)
        m_edges.push_back({distance, depth});
    return !is_dark;
}

Passage::Depth* Passage::edge_at(float distance)
{
    const auto edge = std::ranges::find_if(m_edges, [distance](const Edge& known) {
        return std::abs(known.distance - distance) <= same_place * distance;
    });
    return edge == m_edges.end() ? nullptr : &edge->depth;
}

Vec3f Passage::transmittance() const
{
    const auto left = [](std::int64_t depth) {
        return depth >= most_depth ? 0.0f : static_cast<float>(std::exp2(static_cast<double>(-depth) / units_per_half));
    };
    return {left(m_depth[0]), left(m_depth[1]), left(m_depth[2])};
}

}  // namespace beamspread
