#include "scene/facets.h"

#include <cstdlib>

#include "scene/shadow_ray.h"

namespace beamspread {

namespace {

// Sides of a box as triangles of Hull's corners.
constexpr std::array<std::array<unsigned, 3>, 12> box_facets = {{{0, 1, 3},
                                                                 {0, 3, 2},
                                                                 {4, 6, 7},
                                                                 {4, 7, 5},
                                                                 {0, 4, 5},
                                                                 {0, 5, 1},
                                                                 {2, 3, 7},
                                                                 {2, 7, 6},
                                                                 {0, 2, 6},
                                                                 {0, 6, 4},
                                                                 {1, 5, 7},
                                                                 {1, 7, 3}}};

}  // namespace

std::size_t facet_count(const Occluders& occluders)
{
    return occluders.own_count() + box_facets.size() * occluders.hulls().size();
}

Facet facet(const Occluders& occluders, std::size_t index)
{
    if (index < occluders.own_count()) {
        const std::array<Vec3, 3> corners = occluders.triangle(index);
        return {corners, rounding_of(corners, occluders.origin()), index < occluders.own_opaque_count()};
    }
    const auto [hull, side] = std::lldiv(static_cast<long long>(index - occluders.own_count()), box_facets.size());
    const Hull& box = occluders.hulls()[static_cast<std::size_t>(hull)];
    const auto [a, b, c] = box_facets[static_cast<std::size_t>(side)];
    return {{box.corner(a), box.corner(b), box.corner(c)}, rounding_of(box), false};
}

}  // namespace beamspread
