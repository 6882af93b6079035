#include "medium/medium.h"

#include <cmath>

#include "base/error.h"

namespace beamspread {

void validate(const Medium& medium)
{
    // Negated comparisons reject NaN too.
    if (!(std::abs(medium.g) <= 0.99))
        reject("g", medium.g, "-0.99 <= g <= 0.99");
    if (!(medium.ior >= 1.0 && medium.ior <= 3.0))
        reject("ior", medium.ior, "1 <= ior <= 3");
    if (!(medium.thickness > 0.0))
        reject("thickness", medium.thickness, "thickness > 0 mean free paths, inf for a half-space");
}

void check_albedo(double albedo)
{
    if (!(albedo >= 0.0 && albedo < 1.0))
        reject("albedo", albedo, "0 <= albedo < 1");
}

}  // namespace beamspread
