// Light from a wide range of directions, by rays at few texels, for the choice of its terms.
#pragma once

#include "bake/surface.h"
#include "bake/surface_light.h"
#include "solve/problem/smooth_light.h"

namespace beamspread {

// The moments of a traced light on a surface. `share`: of the surface's texels in those of all surfaces, which share a
// number of probed texels. Throws Cancelled.
SmoothLight smooth_rays(const Surface& surface, const SurfaceLight& light, double share, RaySettings settings,
                        Progress& progress);

}  // namespace beamspread
