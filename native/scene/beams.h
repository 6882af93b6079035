// Receivers, lights and occluders to beams: how much light arrives at each texel, and from where.
#pragma once

#include <limits>

#include "base/progress.h"
#include "base/view.h"
#include "scene/light.h"
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
    // Without, rays are traced from every texel; the result is the same.
    bool find_shadows = true;
};

// What arrives at each texel of a grid; both arrays have its size, and row 0 is the lowest row.
struct BeamArrays {
    View2D<float> irradiance;  // W/m^2: cosine and visible part included
    View2D<Vec3f> direction;  // may have no data: not wanted
    View2D<Vec3f> colored;  // in the place of `irradiance` where occluders are coloured
};

// Unit vectors in single precision point to within this: light nearer to the plane travels within it as far as can be
// told, and adds nothing.
inline constexpr double min_cos_theta = 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon());

// The direction of travel in the plane frame of light without occluders at `point`: a unit vector with
// z <= -min_cos_theta, (0, 0, -1) if light comes from behind or travels within the plane.
Vec3 unblocked_direction(const ReceiverGrid& grid, const Light& light, const Vec3& point);

// Light from behind the plane is 0, and so is light within it. Directions are unit vectors of travel in the plane frame
// with z <= -min_cos_theta, the mean over the texel weighed by irradiance, of all channels together; in the dark the unblocked one at the texel's
// centre. `occluders` may be null. The result does not depend on the number of threads. Throws InvalidArgument,
// Cancelled.
void compute_beams(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                   const BeamSettings& settings, const BeamArrays& beams, Progress& progress);

}  // namespace beamspread
