// An LDF as an image of texel means.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/library/ldf_library.h"

namespace beamspread {

// Mean exitance of each texel per unit incident power, in 1/mfp^2: size x size texels of side `pitch` (mean free
// paths), rows v upward, columns u, O at the centre. The beam lights a disk of this diameter around O evenly (0: a
// point). Throws InvalidArgument.
std::vector<float> ldf_image(const LdfLibrary& library, double angle_deg, double albedo, std::size_t size, double pitch,
                             Side side, double beam_diameter);

// Standard error of each texel of `ldf_image`, from the scatter between groups of batches, with a relative error of
// about a quarter. Throws InvalidArgument.
std::vector<float> ldf_image_standard_error(const LdfLibrary& library, double angle_deg, double albedo,
                                            std::size_t size, double pitch, Side side, double beam_diameter);

}  // namespace beamspread
