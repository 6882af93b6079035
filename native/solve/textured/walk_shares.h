// How the walks of each texel are shared between lights: by the light that each has there.
#pragma once

#include <cstddef>
#include <vector>

#include "base/view.h"
#include "solve/textured/sublattice.h"

namespace beamspread {

class WalkShares {
public:
    // `lights`: the irradiance of each.
    WalkShares(const std::vector<View2D<const float>>& lights, const Sublattices& sublattices);

    // Walks, of `all` in this run of texels of any sublattice, that belong to a light; 0 if none of it can get there.
    std::size_t walks(std::size_t light, std::size_t row, std::size_t run, std::size_t all) const;

    // The most walks of a light, of `all` in any run.
    std::size_t most(std::size_t light, std::size_t all) const;

private:
    void divide_by(const std::vector<double>& sums);  // [row, run]
    void even_out();
    void round();

    std::size_t m_runs;
    std::vector<std::vector<float>> m_shares;  // [light][row, run]
};

}  // namespace beamspread
