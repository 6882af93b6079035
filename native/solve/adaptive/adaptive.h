// The adaptive solver: beams of different widths (Manabe et al. 2012, section 3.3).
#pragma once

#include <vector>

#include "base/progress.h"
#include "solve/adaptive/even_squares.h"
#include "solve/problem/problem.h"

namespace beamspread {

// The squares that it lights by a beam each, with the share of the tolerance that these may use up.
std::vector<Square> beam_squares(const Plane& plane, const PlaneLight& light, double tolerance);

// Exitance that a light of colour 1 causes over one medium, W/m^2, row by row; advances the progress by 1.
std::vector<double> solve_adaptive(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                   double tolerance, Progress& progress);

}  // namespace beamspread
