// Exitance of a sample between the centres of its texels.
#pragma once

#include "base/vec.h"
#include "ldf/samples/sample.h"

namespace beamspread {

// Bilinear between the centres of texels; outside of them the value at the border: an LDF does not end with its image.
double exitance_at(const LdfSample& sample, const Vec2& place);

}  // namespace beamspread
