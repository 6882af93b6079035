// Receivers, lights and occluders to beams: how much light arrives at each texel, and from where.
#pragma once

#include "base/progress.h"
#include "base/view.h"
#include "scene/lights.h"
#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

// Every texel is the mean of samples x samples points in it, each with its own visibility and falloff.
inline constexpr int max_beam_samples = 64;

struct BeamSettings {
    int samples = 4;
    int threads = 0;  // 0: all
    // How far off the plane shadow rays start, in metres, besides what rounding needs: as far as the receiver's own
    // faces, where they are among the occluders, depart from the plane.
    double clearance = 0.0;
};

// What arrives at each texel of a grid; both arrays have its size, and row 0 is the lowest row.
struct BeamArrays {
    View2D<float> irradiance;  // W/m^2: cosine and visible part included
    View2D<Vec3f> direction;  // may have no data: not wanted
};

// Light from behind the plane is 0. Directions are unit vectors of travel in the plane frame with z < 0, the mean over
// the texel weighed by irradiance; in the dark that of the unblocked light at the texel's centre, (0, 0, -1) if that
// comes from behind. `occluders` may be null. The result does not depend on the number of threads. Throws
// InvalidArgument, Cancelled.
void compute_beams(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                   const BeamSettings& settings, const BeamArrays& beams, Progress& progress);

}  // namespace beamspread
