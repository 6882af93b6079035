// The triangles that may shade a receiver: those of their own, and the sides of the boxes around instances.
#pragma once

#include <array>
#include <cstddef>

#include "scene/occluders.h"

namespace beamspread {

struct Facet {
    std::array<Vec3, 3> corners;
    double rounding;  // metres, of the triangle as rays meet it, or of the instance in the box
    bool is_opaque;   // false: light may pass it
};

std::size_t facet_count(const Occluders& occluders);

// The triangles of their own come first, with the same indices as in `occluders`.
Facet facet(const Occluders& occluders, std::size_t index);

}  // namespace beamspread
