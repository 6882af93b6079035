// The adaptive solver: beams of different widths (Manabe et al. 2012, section 3.3).
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/adaptive/even_squares.h"
#include "solve/problem/problem.h"

namespace beamspread {

// Squares that `solve_adaptive` lights by one beam each, within their fraction of the tolerance.
std::vector<Square> beam_squares(const Plane& plane, const PlaneLight& light, double tolerance);

// Exitance of one medium under a light of colour 1, W/m^2, row by row. Advances the progress by 1.
std::vector<double> solve_adaptive(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                   double tolerance, Progress& progress);

}  // namespace beamspread
