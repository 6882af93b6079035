// Directions of travel as angles.
#pragma once

#include "solve/problem/problem.h"

namespace beamspread {

// Angle of incidence in degrees and azimuth in radians of a unit vector of travel.
double incidence_deg(const Vec3& direction);
double azimuth(const Vec3& direction);

// Direction of the beam at a texel.
Vec3 direction_at(const Problem& problem, std::size_t y, std::size_t x);

}  // namespace beamspread
