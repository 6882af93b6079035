// A smooth positive version of an LDF's image, whose logarithm noise cannot spoil.
#pragma once

#include <vector>

#include "ldf/samples/sample.h"

namespace beamspread {

// The image where its relative noise is below 10 %. Elsewhere m blur(image) / blur(m), with m the mean over rings
// around O: averages over as few texels as bring the noise below 10 %, which a steep decline doesn't shift as m has it
// too. Farther out than light was seen m declines exponentially. The noise is that of the part odd in v, which an LDF
// hasn't: a library's image stays as it is.
struct Envelope {
    std::vector<double> value;     // nowhere 0
    std::vector<double> variance;  // of the image's noise in one texel, relative to the value squared
};

Envelope envelope(const LdfSample& sample);

}  // namespace beamspread
