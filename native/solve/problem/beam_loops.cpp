#include "solve/problem/beam_loops.h"

#include <cmath>

#include "base/platform.h"

namespace beamspread {

namespace {

// Of a texel's light; straight down where there is none.
struct Travel {
    float x, y, z;
};

[[gnu::always_inline]] inline Travel travel(const float* direction, float irradiance)
{
    const bool lit = irradiance != 0.0f;
    const float x = direction[0];
    const float y = direction[1];
    const float z = direction[2];
    return {lit ? x : 0.0f, lit ? y : 0.0f, lit ? z : -1.0f};
}

}  // namespace

BEAMSPREAD_CLONES void find_angles(const float* directions, const float* irradiance, float* __restrict cos_beta,
                                   float* __restrict sin_beta, float* __restrict half_tangent, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) {
        const auto [x, y, z] = travel(directions + 3 * i, irradiance[i]);
        const float across = std::sqrt(x * x + y * y);
        const float length = std::sqrt(x * x + y * y + z * z);
        const bool slants = across > 0.0f;
        const float per_across = 1.0f / (slants ? across : 1.0f);
        cos_beta[i] = slants ? x * per_across : 1.0f;
        sin_beta[i] = y * per_across;
        half_tangent[i] = across / (length - z);
    }
}

}  // namespace beamspread
