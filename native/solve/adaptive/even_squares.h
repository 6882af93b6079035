// Squares of a lit plane that one beam each can light (Manabe et al. 2012, section 3.3, Fig. 5).
#pragma once

#include <cstddef>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// Texels y .. y + size - 1, x .. x + size - 1, lit by one beam of that width.
struct Square {
    std::size_t y = 0;
    std::size_t x = 0;
    std::size_t size = 1;
    double irradiance = 0.0;  // mean of its texels, W/m^2
};

// The largest squares of 2^k texels that are wholly lit and even: no texel's irradiance is farther from the square's mean
// than `tolerance` times its own, and no two directions in it differ by more than 1/20 of that: kernels of up to eight
// azimuthal harmonics then differ by less than the tolerance (with 1/10 and 1/40 errors over a lamp are the same). The
// paper takes binary masks; evenness is added for light that varies. Texels that are in no larger square are squares of
// size one; dark ones are in none. Beyond the plane's border it is dark, so that no square crosses that.
std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance);

}  // namespace beamspread
