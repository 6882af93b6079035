// Libraries whose totals are exact: simulated distributions, scaled to what adding-doubling says of their power.
#pragma once

#include "ldf/library/library.h"

namespace beamspread {

// A copy in which the power of every order bin, with the distribution that it comes with, is scaled by as little as
// makes the totals at every other one of `compared_albedos` exact: least squares in the logarithm, weighted by
// statistical variance. The batches follow, so that their scatter is the statistical error that remains.
LdfLibrary calibrated(const LdfLibrary& library, int threads);

}  // namespace beamspread
