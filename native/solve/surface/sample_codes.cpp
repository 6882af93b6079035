#include "solve/surface/sample_codes.h"

#include <algorithm>
#include <limits>

namespace beamspread {

namespace {

// Bits of a position along each axis in its code, and of the side that its normal faces.
constexpr int axis_bits = 20;

// The bits of a number, three apart.
std::uint64_t spread_bits(std::uint64_t x)
{
    x = (x | x << 32) & 0x1f00000000ffffULL;
    x = (x | x << 16) & 0x1f0000ff0000ffULL;
    x = (x | x << 8) & 0x100f00f00f00f00fULL;
    x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
    return (x | x << 2) & 0x1249249249249249ULL;
}

// The axis that a normal is closest to, 0 to 5. Faces back to back are far apart in the tree, however near they are in
// space.
std::uint64_t side_of(const Vec3f& normal)
{
    const Vec3f size = glm::abs(normal);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    return static_cast<std::uint64_t>(2 * axis + (normal[axis] < 0.0f ? 1 : 0));
}

}  // namespace

std::vector<std::uint64_t> codes_of(std::span<const SurfaceSample> samples)
{
    Vec3f low(std::numeric_limits<float>::infinity());
    Vec3f high = -low;
    for (const SurfaceSample& sample : samples) {
        low = glm::min(low, sample.position);
        high = glm::max(high, sample.position);
    }
    const Vec3f size = high - low;
    const float side = std::max({size.x, size.y, size.z, std::numeric_limits<float>::min()});
    const float scale = static_cast<float>((1 << axis_bits) - 1) / side;
    std::vector<std::uint64_t> codes;
    codes.reserve(samples.size());
    for (const SurfaceSample& sample : samples) {
        std::uint64_t code = 0;
        for (int axis = 0; axis < 3; ++axis)
            code |= spread_bits(static_cast<std::uint64_t>((sample.position[axis] - low[axis]) * scale)) << axis;
        codes.push_back(side_of(sample.normal) << (3 * axis_bits) | code);
    }
    return codes;
}

}  // namespace beamspread
