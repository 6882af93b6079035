// Points of the unit circle, several times as fast as the C library's sine and cosine.
#pragma once

#include "base/vec.h"

namespace beamspread {

// (cos, sin) of 2 pi `turn`, which is not negative; right to 1e-10.
Vec2 on_circle(double turn);

}  // namespace beamspread
