// Beams that are seen from afar on coarser grids: multilevel summation of a kernel over a plane.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/adaptive/near_field.h"
#include "solve/adaptive/texel_kernel.h"

namespace beamspread {

double absolute_sum(const Grid& grid);

// Sums over all pairs of texels, kernel(target - source) * light(source). Each level has every other point of the
// one below, and cubic interpolation between them. Far from the source a kernel is smooth, and interpolated at both
// ends from the coarser grid it is as good; near the source the remainder is added pair by pair:
//   K = P K_coarse P^T + R,   R(d) left out beyond a radius.
// The left-out part is summed up in full, so that the error made is known to be within the one allowed.
// (Brandt & Lubrecht 1990, doi:10.1016/0021-9991(90)90171-V.)
class FarField {
public:
    FarField(std::size_t height, std::size_t width);

    // Offsets that a kernel must reach to.
    std::ptrdiff_t reach_y() const { return m_reach_y; }
    std::ptrdiff_t reach_x() const { return m_reach_x; }

    // Adds one kernel's sums; the sum over targets of the absolute error stays below `allowed_error`.
    void add(const KernelTable& kernel, Grid light, double allowed_error);

    // What has been added up to now.
    Grid sum() const;

private:
    struct Level {
        Grid sum;
        bool split_y = false;  // the next level has every other row
        bool split_x = false;
        double cell = 1.0;  // texels that an error at one point of this level spreads over
    };

    std::vector<Level> m_levels;
    std::ptrdiff_t m_reach_y = 0;
    std::ptrdiff_t m_reach_x = 0;
};

}  // namespace beamspread
