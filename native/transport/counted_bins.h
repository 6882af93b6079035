// Which radius bins light is counted in, by medium and order of scattering.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "medium/medium.h"

namespace beamspread {

// Order bins below this go by all radius bins, the others by quarters of octaves. Nothing is as sharp as the finer bins
// but few scatterings around the mirror images of the beam in a thin slab's sides.
std::uint32_t fine_orders(const Medium& medium);

// Of the first `radii` bins, those that light of an order bin is counted in.
std::vector<std::size_t> counted_bins(const Medium& medium, std::size_t order_bin, std::size_t radii);

}  // namespace beamspread
