// Own light of a sample whose neighbors are no even lattice, as where an edge cuts texels. Samples stand as disks, which
// overlap and leave gaps: the sample's own light fills up what the others leave of the surface, so that even light is that
// of an even surface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "solve/surface/chord_table.h"

namespace beamspread {

// Its steps span its area.
struct UnevenSample {
    Vec3f position, normal, tangent;
    Vec3f step_x, step_y;
    float side;  // of its texel, as if no edge cut it, metres
};

// A sample near an uneven one, and the disk by which its light counts.
struct NearSample {
    Vec3f position, normal;
    Vec3f step_x, step_y;
    float area;
    float disk;  // radius, metres
};

// Harmonics m = 0, 1, ... of what is left.
inline constexpr std::size_t uneven_harmonics = 3;

// Chord steps of a ring.
inline constexpr std::uint32_t steps_per_ring = 4;

// Largest distance of samples that count as near, in sides of the texel.
inline constexpr float near_sides = 2.5f;

// Most samples that count as near; where texels beside are far smaller, there are more, and the sample has the own light of
// a lattice. More: longer.
inline constexpr std::size_t most_near = 512;

// Least radius of a ring, over that of the smallest disk: no other sample's disk comes nearer.
inline constexpr float least_ring = disk_begin_radii - 1.0f;

// Integrals over the azimuth of light's way around a ring, times cos and sin(m phi): [m][cosine, sine].
using RingIntegrals = std::array<float, 2 * uneven_harmonics>;

struct UnevenRings {
    std::uint32_t first = 0;  // chord step at which they begin; all of the surface within is the sample's own
    std::vector<RingIntegrals> left;  // [ring] of the surface, less those of all disks
};

// Rings around a sample, from a chord step on.
UnevenRings rings_around(const UnevenSample& own, std::uint32_t least_step, const std::vector<NearSample>& near);

}  // namespace beamspread
