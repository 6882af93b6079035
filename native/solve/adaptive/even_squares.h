// Evenly lit squares of a plane as wide beams (Manabe et al. 2012, Sec. 3.3, Fig. 5).
#pragma once

#include <cstddef>
#include <vector>

#include "solve/adaptive/grid.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Texels y .. y + size - 1, x .. x + size - 1, lit by one beam of that width.
struct Square {
    std::size_t y = 0;
    std::size_t x = 0;
    std::size_t size = 1;
    double irradiance = 0.0;  // mean of its texels, W/m^2
};

// The largest squares of 2^k texels that are fully lit and even: each texel's irradiance is within `tolerance` times
// itself of the square's mean, and directions differ by at most 1/20 of the tolerance, with which kernels of up to
// eight azimuthal harmonics differ by less than the tolerance. The paper has binary masks; evenness extends them to
// varying light. Lit texels in no larger square are squares of size one. The outside of the plane counts as dark.
std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance);

// Moves the light of squares out of `light` and returns it as steps at their corners. A square is the sum of four
// steps; each lights everything above and to the right of a corner. Steps of adjacent squares of the same light cancel.
Grid take_steps(Grid& light, const std::vector<Square>& squares);

// Kernel of a step: the sums of a kernel over all offsets below and to the left, for offsets from the corner.
KernelTable step_kernel(const Grid& kernel);

}  // namespace beamspread
