#include "solve/separable/kernel_term.h"

namespace beamspread {

double reach(const RadialProfile& profile, double mean_free_path, double fraction)
{
    const double allowed = fraction * profile.cumulative(profile.support())[0];
    for (std::size_t k = 0; k < edge_count; ++k)
        if (profile.remaining(radial_edge(k))[0] <= allowed)
            return radial_edge(k) * mean_free_path;
    return profile.support() * mean_free_path;
}

}  // namespace beamspread
