#include "solve/row_sum.h"

namespace beamspread {

// Compiled for several instruction sets, the best chosen at run time. Without contraction to fused multiply-add the
// results are the same for all.
__attribute__((target_clones("default", "avx2", "avx512f"))) void add_scaled(double* sum, const double* values,
                                                                             double factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

}  // namespace beamspread
