// Which texels of a receiver no occluder can shade, and which one triangle shades all of, found without rays.
//
// An instance of a mesh counts by the box around it, and no texel's shade is known where triangles and boxes are too
// many: finding their shadows would take longer than tracing.
//
// Beams need this many times as long if rays are traced from every texel, 16 a texel, on 512^2 to 1024^2 texels
// (tests/bench/gather.py): one card 3 for a lamp and some 100 for a sun, a sphere of 1000 triangles 3 and 19 to 45, 1000
// loose leaves 4 to 5 and 5 to 8, a sphere of 1e5 triangles 1.2 to 1.5 and 2 to 4, 1e5 leaves 1 and 0.9.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/ray_start.h"
#include "scene/receiver.h"

namespace beamspread {

enum class Shade : std::uint8_t {
    none,  // the texel is out of reach of all shadows: no ray from it is blocked
    unknown,  // some of its rays may be blocked
    full,  // the shadow of one opaque triangle covers it: every ray from it is blocked
};

// The triangles' shadows on the plane, by bands of rows. Both bounds allow for the rounding of rays, so that tracing
// all of them would give the same.
class Shadows {
public:
    static constexpr std::size_t rows_per_band = 8;

    // `occluders` may be null: no shade anywhere. Without `find` no texel's shade is known.
    Shadows(const ReceiverGrid& grid, const LightSource& source, const Occluders* occluders, const RayStart& start,
            bool find);

    std::size_t bands() const { return (m_grid.height + rows_per_band - 1) / rows_per_band; }

    // The shade of the texels of a band, row by row.
    void shade_band(std::size_t band, std::vector<Shade>& texels) const;

private:
    // A triangle, or one of those of which an instance's box is made.
    struct Facet {
        std::array<Vec3, 3> corners;
        double rounding;
        bool is_opaque;  // else it is no more than a place where something may block
    };

    Facet facet(std::size_t index) const;
    std::size_t facet_count() const;

    const ReceiverGrid& m_grid;
    LightSource m_source;
    const Occluders* m_occluders;
    RayStart m_start;
    bool m_is_unknown = false;  // a triangle whose shadow has no end lies in the way
    // Numbers of facets, in the nodes of a binary tree over the bands. A facet is in the one or two nodes, side
    // by side, that span its shadow's rows, so that tall ones take no more memory than small ones.
    std::vector<std::vector<std::uint32_t>> m_nodes;
    std::size_t m_leaves = 0;
};

}  // namespace beamspread
