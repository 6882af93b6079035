// Lights of a size and occluders to rays: what arrives at each texel, direction by direction.
#pragma once

#include <cstdint>

#include "base/progress.h"
#include "scene/extended_light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

// One ray at each texel of a part of a row.
struct RayRow {
    std::size_t ray = 0;  // of those of a texel
    std::size_t y = 0;
    std::size_t x = 0;
    std::size_t width = 0;
    const Vec3f* travel = nullptr;      // [texel] unit vectors of the plane frame, z <= -min_cos_theta
    const Vec3f* irradiance = nullptr;  // [texel] W/m^2 in each channel, cosine and visibility included
};

// Takes the rays of a grid. Called from several threads at once, for one row by one of them.
class RaySink {
public:
    virtual ~RaySink() = default;
    virtual void add(const RayRow& row) = 0;
};

inline constexpr int max_rays = 4096;

struct RaySettings {
    int rays = 16;  // from each texel
    int threads = 0;  // 0: all
    double clearance = 0.0;  // see BeamSettings
    std::uint32_t seed = 0;
    // First, a look by so many rays: where they, and those of the texels around, all met light or all an obstacle, they
    // are enough. 0: no look.
    int even_rays = 0;
};

// At most `rays` rays from each texel; their sum is the light of the texel. Low-discrepancy over the texel and
// over the light, from a seed: the same for any number of threads. Where nothing is in the way the sum is that of many
// more rays, without noise. `occluders` may be null. Throws InvalidArgument, Cancelled.
void gather_rays(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                 const RaySettings& settings, RaySink& sink, Progress& progress);

}  // namespace beamspread
