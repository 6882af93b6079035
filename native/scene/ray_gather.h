// The one tracer: lights and occluders to rays that arrive at the samples of a receiver.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/progress.h"
#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

// One ray at each of some samples that follow each other. A sample is a point of a receiver with a normal; the texels of
// a grid are the samples y * width + x.
struct RayRun {
    std::size_t sample = 0;  // the first one
    std::size_t count = 0;   // samples; in a grid all of one row
    std::size_t ray = 0;     // index among the rays of a sample
    // [count] unit vectors in the tangent frame of the sample, with z <= -min_cos_theta (shadow_ray.h); null without
    // `with_travel`.
    const Vec3f* travel = nullptr;
    const Vec3f* irradiance = nullptr;  // [count] W/m^2 in each channel, cosine and visibility included
};

// Takes the rays of a receiver. Several threads call `add` at once, each for a row of samples of its own.
class RaySink {
public:
    virtual ~RaySink() = default;
    virtual void add(const RayRun& run) = 0;
};

// Largest numbers in RaySettings.
inline constexpr int max_samples = 64;
inline constexpr int max_rays = 4096;

// Noise of light by rays, on average over texels.
struct RayNoise {
    double irradiance = 0.0;  // mean of receiving texels and channels, W/m^2
    double variance = 0.0;  // mean variance of a texel's irradiance, (W/m^2)^2

    // Adds light of another strength.
    void add(const RayNoise& light, double strength)
    {
        irradiance += strength * light.irradiance;
        variance += strength * strength * light.variance;
    }
};

struct RaySettings {
    // Delta lights: the ray of a texel is the mean over samples x samples points in it, each with its own visibility and
    // falloff.
    int samples = 4;
    // Lights of a size: rays from each texel, rounded down to a power of two, like all numbers of rays: as many of Sobol's
    // points are spread evenly, and a part of them is not (128 have less noise than 303).
    int rays = 16;
    // Lights of a size: rays of a first pass. They are enough in texels that, with their neighbors, see only light or only
    // obstacles, and in all texels without occluders. 0: no first pass.
    int even_rays = 0;
    // Lights of a size: true takes their falloff at a texel's center also near them, which is faster and less exact.
    bool at_centers = false;
    std::uint32_t seed = 0;
    // Height above the plane where shadow rays start, metres, besides what rounding needs: the largest distance of the
    // receiver's own faces to the plane, where they are among the occluders. Where the receiver bends, the height above the
    // face of each texel, besides what that needs.
    double clearance = 0.0;
    int threads = 0;  // 0: all
    bool with_travel = true;
    // False traces rays from every texel, also where none can be blocked; the result is the same.
    bool find_shadows = true;
    // Takes the noise of the light besides; may be null.
    RayNoise* noise = nullptr;
};

// Hands all rays of a light to the sink; the rays of a texel add up to its light. The result is the same for any number
// of threads. `occluders` may be null. Throws InvalidArgument, Cancelled.
//
// A delta light gives one ray per texel, which travels in the mean direction weighed by irradiance. A light of a size
// gives up to `rays` rays, of low discrepancy over the texel and over the light, from a seed. Where nothing blocks it, they
// add up without noise to the sum of many more rays. Rays without light travel along (0, 0, -1).
void gather_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const RaySettings& settings,
                 RaySink& sink, Progress& progress);

namespace detail {

// `gather_rays` of a light without a size, on the threads of the caller; arguments are checked.
void gather_delta_rays(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                       const RaySettings& settings, RaySink& sink, Progress& progress);

}  // namespace detail

}  // namespace beamspread
