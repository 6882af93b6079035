#include "solve/row_sum.h"

#include "solve/target_clones.h"

namespace beamspread {

BEAMSPREAD_CLONES void add_scaled(double* sum, const double* values, double factor, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i)
        sum[i] += factor * values[i];
}

}  // namespace beamspread
