// Interpolation of LDFs between samples.
#pragma once

#include <optional>
#include <vector>

#include "ldf/samples/ldf_sample.h"
#include "ldf/samples/sample_grid.h"

namespace beamspread {

enum class Interpolation { angular, adaptive, planar };

// Interpolates the LDF at an angle, albedo and g from samples on a regular grid.
//
// angular: Manabe et al. 2012, Eq. 3 and 4. Exitance is blended with linear weights in angle, albedo and g at the same
// direction of angular space; H and Q, `height` mean free paths above it, are blended with the same weights. As all
// points Q have one height, texels keep their solid angles: the total of the blend is the blend of the totals, except
// for light that moves across the images' borders. The result does not depend on the height, because the maps to
// angular space and back cancel except for the shift of H.
//
// planar: the same weights at the same (u, v).
//
// adaptive: see adaptive_interpolation.cpp.
//
// Returns a sample's own image at its angle, albedo and g. Throws InvalidArgument.
LdfSample interpolate(const std::vector<const LdfSample*>& samples, double angle_deg, double albedo,
                      std::optional<double> g, Interpolation method, std::optional<double> height);

// The image of method `adaptive` at an angle, albedo and g inside the cell.
std::vector<float> adaptive_image(const SampleCell& cell, double angle_deg, double albedo, std::optional<double> g);

}  // namespace beamspread
