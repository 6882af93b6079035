// LDFs between samples.
#pragma once

#include <optional>
#include <vector>

#include "ldf/samples/ldf_sample.h"
#include "ldf/samples/sample_grid.h"

namespace beamspread {

enum class Interpolation { angular, adaptive, planar };

// The LDF at an angle, albedo and g from the samples around it, which form a regular grid.
//
// angular: Manabe et al. 2012, Eq. 3 and 4: exitance is blended, bilinearly in angle and albedo and trilinearly
// with g, at the same place of angular space; H and Q, `height` mean free paths above it, are blended with the same
// weights. Blending exitance at the same directions from points Q of one height keeps the solid angle of each texel:
// the total of the blend is the blend of the totals, but for what moves across the border of the images. (With one
// height for all, the maps to angular space and back cancel but for the shift of H: the result doesn't depend on the
// height.)
//
// planar: the same weights at the same (u, v).
//
// adaptive: see adaptive_interpolation.cpp.
//
// A sample that is asked for comes out as it is. Throws InvalidArgument.
LdfSample interpolate(const std::vector<const LdfSample*>& samples, double angle_deg, double albedo,
                      std::optional<double> g, Interpolation method, std::optional<double> height);

// The image at a place inside the cell.
std::vector<float> adaptive_image(const SampleCell& cell, double angle_deg, double albedo, std::optional<double> g);

}  // namespace beamspread
