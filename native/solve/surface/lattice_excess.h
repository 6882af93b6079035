// Excess of the light of evenly lit disks on a lattice over that of an even plane: samples stand as disks, which overlap
// and leave gaps. Where the medium spreads about as far as the lattice's steps, their sum is not that of the plane.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/vec.h"
#include "ldf/radial/radial_profile.h"
#include "solve/surface/surface_basis.h"

namespace beamspread {

// Replaces two steps of a lattice by its shortest one and the shortest one of all others (Gauss's reduction).
template <class Vector>
void reduce_steps(Vector& shortest, Vector& next)
{
    constexpr int most_rounds = 64;  // rounding alone would take as many
    for (int round = 0; round < most_rounds; ++round) {
        if (glm::dot(next, next) < glm::dot(shortest, shortest))
            std::swap(shortest, next);
        const auto times = std::nearbyint(glm::dot(shortest, next) / glm::dot(shortest, shortest));
        if (!(std::abs(times) >= 1))
            return;
        next -= times * shortest;
    }
}

// Shape of the lattice around a sample.
struct LatticeShape {
    LatticeShape() = default;  // square, its azimuth unknown

    // The lattice of two steps, in any unit, of the sample's tangent plane.
    LatticeShape(Vec2f step_x, Vec2f step_y);

    // The shortest step is as long as 1; the next row lies at these distances along and across it.
    float along = 0.0f;  // 0 to .5: see `mirrored`
    float across = 1.0f;  // at least sqrt(3) / 2
    bool is_mirrored = false;  // true if the next row lies at -`along`
    Vec2f shortest{0.0f};  // unit vector along the shortest step; 0: unknown
};

// A sample's neighborhood: the shape of the lattice, and the radius of its neighbors' disks. Tables have these.
inline constexpr std::size_t along_count = 5;
inline constexpr std::size_t across_count = 17;
inline constexpr std::size_t ratio_count = 3;
inline constexpr std::size_t neighborhood_count = ratio_count * across_count * along_count;

// Indices of the neighborhoods of tables around one, and their weights. The neighbors' disks are larger than their area by
// these octaves of the radius.
struct Neighborhoods {
    Neighborhoods(const LatticeShape& shape, float octaves);

    std::array<std::size_t, 8> index;
    std::array<float, 8> weight;
};

// Even harmonics m = 0, 2, ... of the tables.
inline constexpr std::size_t even_harmonics = surface_harmonics / 2;

// The excess per irradiance of the harmonics c_m(r) cos(m (phi - beta)) of a profile, each as factors of cos and
// sin(m beta), with azimuths from the shortest step: [neighborhood][m / 2][cosine, sine]. That of odd m is 0. `disk`: radius
// of the neighbors' disks in mean free paths; `harmonics`: number of even ones that are wanted, the others are 0.
std::vector<double> lattice_excess(const RadialProfile& profile, double disk, std::size_t harmonics);

}  // namespace beamspread
