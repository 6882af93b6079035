// An order in which samples near to each other that face the same way follow each other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solve/surface/surface_tree.h"

namespace beamspread {

// A code of each sample: the side that its normal faces, then the bits of its position, one of each axis in turn (Morton
// 1966).
std::vector<std::uint64_t> codes_of(std::span<const SurfaceSample> samples);

}  // namespace beamspread
