// How the walks of each texel are shared between lights: by the light that each has there.
#pragma once

#include <cstddef>
#include <vector>

#include "base/view.h"
#include "solve/textured/sublattice.h"

namespace beamspread {

class WalkShares {
public:
    // `lights`: the irradiance of each, of any size.
    WalkShares(const std::vector<View2D<const float>>& lights, const Sublattices& sublattices);

    // Walks, of `all` in this tile of any sublattice, that belong to a light; 0 if none of it can get there.
    std::size_t walks(std::size_t light, std::size_t down, std::size_t across, std::size_t all) const;

    // The most walks of a light, of `all` in any tile.
    std::size_t most(std::size_t light, std::size_t all) const;

private:
    void divide_by(const std::vector<double>& sums);  // [down, across]
    void even_out();
    void round();

    std::size_t m_across;
    std::vector<std::vector<float>> m_shares;  // [light][down, across]
};

}  // namespace beamspread
