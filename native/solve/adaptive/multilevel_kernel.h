// A kernel as a sum of kernels on coarser and coarser grids.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/radial/radial_profile.h"
#include "ldf/radial/texel_integral.h"
#include "solve/adaptive/grid.h"

namespace beamspread {

// A grid of the hierarchy. The finest is that of the texels; each next one has every other row, column, or both.
// Lengths are in mean free paths.
struct GridLevel {
    std::size_t height = 0;
    std::size_t width = 0;
    double pitch_y = 1.0;
    double pitch_x = 1.0;
    bool halves_y = false;
    bool halves_x = false;
    double near_radius = 0.0;  // distance beyond which coarser grids sum the pairs of points
};

// The grids of a plane; `near` is the near radius of each level in points of its grid. An axis is halved while it keeps
// more points than the near radius has, the axis of the finer pitch first until points are about square.
std::vector<GridLevel> grid_levels(std::size_t height, std::size_t width, double pitch_y, double pitch_x, double near);

// A combination of harmonics of one profile: the sum over m of c_m(r) (cosine[m] cos(m phi) + sine[m] sin(m phi)).
struct HarmonicSum {
    Harmonics cosine{};
    Harmonics sine{};
};

// Kernels of one profile, the power from a texel's beam in another texel, by multilevel summation (Hardy et al. 2009,
// doi:10.1016/j.parco.2008.12.005): the sum over levels k of
//   K_k(r) = K(r) w_0(r) ... w_k-1(r) (1 - w_k(r)).
// w_k rises smoothly from 0 at the beam to 1 at the near radius of level k: K_k is smooth enough for the grid of level
// k and zero beyond its near radius.
class MultilevelKernel {
public:
    MultilevelKernel(const RadialProfile& profile, const std::vector<GridLevel>& levels);

    // K_k for each level.
    std::vector<KernelTable> tables(const HarmonicSum& harmonics) const;

private:
    // Integrals for the offsets (0 .. height - 1, 0 .. width - 1) of a level's grid; other quadrants follow by
    // symmetry.
    struct Quadrant {
        std::size_t height;
        std::size_t width;
        TexelIntegrals integrals;
        std::vector<double> window;  // factor of K
    };
    std::vector<Quadrant> m_levels;
};

}  // namespace beamspread
