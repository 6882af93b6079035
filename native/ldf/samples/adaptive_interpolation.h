// Interpolation of samples that follows how LDFs depend on angle, albedo and anisotropy.
#pragma once

#include <optional>
#include <vector>

#include "ldf/samples/sample_grid.h"

namespace beamspread {

// The image at a place inside the cell.
std::vector<float> adaptive_image(const SampleCell& cell, double angle_deg, double albedo, std::optional<double> g);

}  // namespace beamspread
