// Luminance of a mesh that bends, by the solver `surface`: its samples are the texels inside it.
#pragma once

#include <vector>

#include "bake/bake.h"

namespace beamspread {

// Writes (height, width, channels) without the color of light that leaves; 0 outside of the mesh. `lights`: those that
// arrive. Throws InvalidArgument, MemoryLimit, Cancelled.
BentShares bake_bent(const Surface& surface, const std::vector<const SurfaceLight*>& lights,
                     const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                     float* luminance);

}  // namespace beamspread
