// Luminance by a light field, of lights of any number and size in memory that does not grow with them.
#pragma once

#include <vector>

#include "bake/bake.h"
#include "bake/canvas_light.h"
#include "bake/stored_light.h"

namespace beamspread {

// Units of progress: gathering a light without a size, and the solver's choice of terms or its transforms. Measured for
// 512 x 512 texels.
inline constexpr double light_work = 1.0;
inline constexpr double solver_work = 3.0;

// Writes the luminance of a canvas without the color of light that leaves its surfaces. `problem` has no lights yet.
void bake_by_field(const Canvas& canvas, const std::vector<CanvasLight>& lights, const BakeOptions& options,
                   const Problem& problem, Progress& progress, float* luminance);

}  // namespace beamspread
