// Shadow borders of a delta light, found without rays: texels that no occluder can shade, and texels that one triangle
// shades wholly.
//
// An instance of a mesh counts by the box around it. If there are too many triangles and boxes, no texel's shade is known,
// because finding the shadows would take longer than tracing rays; nor is it on a mesh that bends. docs/tuning.md has the speed-up
// (tests/bench/gather.py).
#pragma once

#include <cstdint>
#include <vector>

#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"
#include "scene/shadow_ray.h"

namespace beamspread {

enum class Shade : std::uint8_t {
    none,  // no shadow reaches the texel: no ray from it is blocked
    unknown,  // some of its rays may be blocked
    full,  // the shadow of one opaque triangle covers the texel: every ray from it is blocked
};

// Shadows of triangles on the plane, by bands of rows. The bounds of shadows include the rounding of rays, so that tracing
// every texel gives the same result.
class Shadows {
public:
    // Texel rows of a band. More: fewer searches of triangles, less parallel.
    static constexpr std::size_t rows_per_band = 8;

    // `occluders` may be null: nothing is shaded. Without `find` no texel's shade is known.
    Shadows(const ReceiverGrid& grid, const LightSource& source, const Occluders* occluders, const RayStart& start,
            bool find);

    std::size_t bands() const { return (m_grid.height + rows_per_band - 1) / rows_per_band; }

    // Finds the shade of the texels of a band, row by row.
    void shade_band(std::size_t band, std::vector<Shade>& texels) const;

private:
    const ReceiverGrid& m_grid;
    LightSource m_source;
    const Occluders* m_occluders;
    RayStart m_start;
    bool m_is_unknown = false;  // true if a triangle whose shadow has no end blocks light
    // Indices of facets in the nodes of a binary tree over the bands. A facet is in the one or two neighboring nodes that
    // span the rows of its shadow, so that tall shadows take no more memory than small ones.
    std::vector<std::vector<std::uint32_t>> m_nodes;
    std::size_t m_leaves = 0;
};

}  // namespace beamspread
