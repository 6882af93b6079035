// Rays of lights without a size: one for each texel.
#pragma once

#include "scene/ray_gather.h"

namespace beamspread {

// `gather_rays` of a delta light, on the threads of the caller; arguments are checked.
void gather_delta_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                       const RaySettings& settings, RaySink& sink, Progress& progress);

}  // namespace beamspread
