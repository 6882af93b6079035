// Libraries whose totals are exact: simulated distributions, scaled to what adding-doubling says of their power.
#pragma once

#include "ldf/library/library.h"

namespace beamspread {

// A copy in which the power p_b of every order bin, with the distribution that it comes with, is scaled by the s_b that
// minimize  sum_b (s_b - 1)^2 / v_b + sum_k ((sum_b a_k^n_b s_b p_b - T_k) / e_k)^2:  v_b is the relative variance of
// p_b, and T_k the exact total at albedo a_k, every other one of `compared_albedos`, to within e_k. The batches follow,
// so that their scatter is the statistical error that remains. Throws InvalidArgument for a library of too few photons.
LdfLibrary calibrated(const LdfLibrary& library, int threads);

}  // namespace beamspread
