// What arrives at the texels of a grid from a light of a size with nothing in between.
#pragma once

#include <vector>

#include "scene/light.h"
#include "scene/receiver.h"

namespace beamspread {

// Near the light it is asked at each texel; farther away, where irradiance is smooth, at nodes some texels apart, as a mesh
// of many faces takes its time.
class OpenIrradiance {
public:
    // Both must outlive it.
    OpenIrradiance(const ReceiverGrid& grid, const Light& light);

    // The mean over texel (x, y), W/m^2 in each channel.
    Vec3 at(std::size_t x, std::size_t y) const;

private:
    Vec3 in_texel(double x, double y) const;
    Vec3 between_nodes(std::size_t x, std::size_t y) const;

    const ReceiverGrid& m_grid;
    const Light& m_light;
    double m_pitch;
    Vec3 m_everywhere{0.0};  // of a light infinitely far away
    std::size_t m_columns = 0;
    std::vector<Vec3> m_nodes;  // of every `texels_per_node`-th texel, one before the first on; empty: none
};

}  // namespace beamspread
