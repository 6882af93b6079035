// The brightest point of an LDF.
#pragma once

#include "base/vec.h"
#include "ldf/samples/sample.h"

namespace beamspread {

// H of Manabe et al. 2012 (Sec. 3.2), mean free paths from O. An LDF is even in v, so H lies on v = 0, and what is odd
// in v is noise: the image's even part is smoothed as little as brings that noise below 1 % of the peak. H then is the
// vertex of the paraboloid fitted to the top of the peak, all texels around the brightest one of at least 95 % of it.
// Where the top is so narrow that the texels don't resolve it, and is next to O, H is O: a pencil beam's peak.
Vec2 brightest_point(const LdfSample& sample);

}  // namespace beamspread
