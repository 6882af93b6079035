// How the walks of each texel are shared between lights: by the light that each has there.
#pragma once

#include <cstddef>
#include <vector>

#include "base/view.h"
#include "solve/textured/sublattice.h"

namespace beamspread {

class WalkShares {
public:
    // `lights`: the irradiance of each, of any size. `groups`: lights that may share walks.
    WalkShares(const std::vector<View2D<const float>>& lights, const std::vector<std::vector<std::size_t>>& groups,
               const Sublattices& sublattices);

    // Walks, of `all` in this tile of any sublattice, that belong to a light; 0 if none of it can get there.
    std::size_t walks(std::size_t light, std::size_t down, std::size_t across, std::size_t all) const;

    // The most walks of a light, of `all` in any tile.
    std::size_t most(std::size_t light, std::size_t all) const;

    // Walks that are drawn for a group of lights: each light has the most that it needs, and they share as few as drawing
    // in some time allows.
    std::size_t drawn(std::size_t group, std::size_t all) const;

    // Index of the first drawn walk that a light takes; `number`: of the light in its group.
    std::size_t start(std::size_t group, std::size_t number, std::size_t all) const;

    // Walks that take the time of one of light of a single direction; at least 1.
    double walks_at_once() const;

private:
    std::size_t apart(std::size_t all) const;
    void divide_by(const std::vector<double>& sums);  // [down, across]
    double most_of(std::size_t light) const;
    void even_out();
    void round();

    std::size_t m_across;
    std::vector<std::vector<std::size_t>> m_groups;
    std::vector<std::vector<float>> m_shares;  // [light][down, across]
};

}  // namespace beamspread
