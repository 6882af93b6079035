// Irradiance at the texels of a grid by a light of a size that nothing blocks.
#pragma once

#include <vector>

#include "scene/light.h"
#include "scene/receiver.h"

namespace beamspread {

// Near the light irradiance is computed at each texel; farther away, where it is smooth, at nodes some texels apart, because a
// mesh of many faces takes time. Where the receiver bends it is computed at each texel.
class OpenIrradiance {
public:
    // The first two must outlive the object. `at_centers`: see RaySettings.
    OpenIrradiance(const ReceiverGrid& grid, const Light& light, bool at_centers);

    // Mean irradiance of texel (x, y), W/m^2 in each channel.
    Vec3 at(std::size_t x, std::size_t y) const;

private:
    Vec3 in_bent_texel(std::size_t texel) const;
    Vec3 in_texel(double x, double y) const;
    Vec3 in_texel(double x, double y, const Vec3& normal, double pitch) const;
    Vec3 between_nodes(std::size_t x, std::size_t y) const;

    const ReceiverGrid& m_grid;
    const Light& m_light;
    double m_pitch;
    bool m_at_centers;
    Vec3 m_everywhere{0.0};  // irradiance by a light infinitely far away
    std::size_t m_columns = 0;
    // Irradiance of every `texels_per_node`-th texel, from one before the first; of every texel where they bend. May be
    // empty.
    std::vector<Vec3> m_nodes;
};

}  // namespace beamspread
