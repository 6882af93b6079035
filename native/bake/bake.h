// Light that falls on a surface and spreads in it: lights, occluders and media to luminance, irradiance or direction.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "bake/surface.h"
#include "bake/surface_light.h"
#include "base/progress.h"
#include "solve/problem/problem.h"
#include "solve/spectral/light_field.h"

namespace beamspread {

// Shares of a mesh that bends; 0 on planes.
struct BentShares {
    double beyond = 0.0;  // of its area, which bends more than the LDFs of the media cover
    double solved = 0.0;  // of its texels; others are interpolated
};

struct BakeOptions {
    Solver solver = Solver::fft;
    double tolerance = 5e-3;  // largest relative error of a texel by approximating solvers
    int samples = 4;          // lights without a size: samples x samples points in each texel
    int rays = 256;           // lights of a size: rays from each texel, to all of them together
    int min_rays = 8;         // lights of a size: rays from each texel to each of them, at least
    std::uint32_t seed = 0;   // seed of the rays
    int threads = 0;          // 0: all
    // Solver `fft`: bytes of irradiance of lights of one direction that are stored until the solver sees all of them.
    // Beyond, light is added as moments, and terms are chosen for the brightest lights.
    std::size_t max_stored_bytes = std::size_t{512} << 20;
    std::size_t max_moment_bytes = 0;  // bytes of moments; 0: any
    RayNoise* noise = nullptr;  // takes the noise of all lights by rays; may be null
    std::vector<BentShares>* bent_shares = nullptr;  // takes those of each surface; may be null
    bool at_centers = false;  // see RaySettings

    // Settings for a light of so many rays from each texel.
    RaySettings ray_settings(int ray_count) const;
};

// Light of a bake on one of its surfaces, [light]; none where the light does not arrive.
using ArrivingLights = std::vector<std::optional<SurfaceLight>>;

// Writes (height, width, channels) of each surface, exitance / pi in W/(m^2 sr) (Manabe et al. 2012, Eq. 2). Light does
// not pass from surface to surface. Planes are solved by the solver of the options; meshes that bend by pairs of samples,
// for `direct` by all of them one by one, with 0 outside of the mesh. `lights`: [surface], all of the same number. The
// result is the same for any number of threads. Throws InvalidArgument, MemoryLimit, Cancelled.
void bake_luminance(const std::vector<Surface>& surfaces, const std::vector<ArrivingLights>& lights,
                    const std::vector<ChannelMedium>& channels, const BakeOptions& options, Progress& progress,
                    const std::vector<float*>& luminance);

// Luminance by a field that is kept from bake to bake, which only `options.rays` of each light are added to.
void bake_luminance(const Surface& surface, const std::vector<SurfaceLight>& lights, LightField& field,
                    const BakeOptions& options, Progress& progress, float* luminance);

// A field for light of any azimuth and any angle of incidence up to `max_angle` degrees; light beyond counts as at that
// angle. Its kernels are off by `tolerance`. `is_colored`: true if lights may differ in color.
std::unique_ptr<LightField> any_light_field(const Plane& plane, const std::vector<ChannelMedium>& channels,
                                            double max_angle, double tolerance, bool is_colored, int threads);

// Light on the whole of each texel, without a medium; 0 outside of a mesh that bends. Writes the irradiance (height, width, channels), W/m^2, and the
// flow (height, width, 3): the sum of the irradiance, the mean of its channels, times the unit vector along which it
// travels in the frame of the plane or of each texel. Throws InvalidArgument, Cancelled.
void bake_arrival(const Surface& surface, const std::vector<SurfaceLight>& lights, const BakeOptions& options,
                  Progress& progress, float* irradiance, float* flow);

}  // namespace beamspread
