// Light of one source on the plane.
#pragma once

#include "base/view.h"
#include "solve/problem/problem.h"

namespace beamspread {

struct LightField {
    View2D<const float> irradiance;
    Directions directions;
};

}  // namespace beamspread
