// Tables over the chord of the light that a surface returns around a sample.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/threads.h"
#include "solve/surface/surface_basis.h"

namespace beamspread {

// Tables over the chord have 2^chord_bits steps per octave and are linear in between. More: smaller errors, more memory.
inline constexpr int chord_bits = 4;
inline constexpr int within_chord_bits = 23 - chord_bits;

inline std::uint32_t chord_step(float chord)
{
    return std::bit_cast<std::uint32_t>(chord) >> within_chord_bits;
}

// First chord of a step, metres.
inline float chord_of(std::uint32_t step)
{
    return std::bit_cast<float>(step << within_chord_bits);
}

// Largest number of results of a pair.
inline constexpr std::size_t max_results = 3;

// Values e(c, k) c^2 without unit, for light that comes from a point or a disk. They change slowly with the chord c.
struct ChordTable {
    std::uint32_t first = 0;                   // step of the first row
    std::uint32_t rows = 0;                    // at least 2
    std::vector<AlignedVector<float>> values;  // [group of `PairLanes`], [curvature][row][lane]

    std::size_t bytes() const
    {
        std::size_t sum = 0;
        for (const AlignedVector<float>& of_result : values)
            sum += of_result.size() * sizeof(float);
        return sum;
    }
};

// Least chord of another sample, in radii: it lies outside of the disk. Texels at the rims of UV islands are cut, and their
// middles lie within the disks of their neighbors.
inline constexpr float disk_begin_radii = 1.125f;

// Light of a disk, which stands for a sample.
struct DiskTable {
    float radius = 0.0f;  // metres
    float begin = 0.0f;   // least chord of other samples, metres: samples do not overlap, disks may
    float end = 0.0f;     // chord from which its light counts as a point's, metres
    ChordTable light;
    std::vector<AlignedVector<float>> excess;  // [group], [neighborhood][cosine, sine][lane]: see `lattice_excess`
};

// Light of a point.
struct PointTable {
    ChordTable light;
    // Second derivatives times c^4, with the rows of `light`: e'' + e' / c - m^2 e / c^2; that along the chord less that
    // across it, e'' - e' / c + m^2 e / c^2; and that along both, 2 m (e / c^2 - e' / c).
    ChordTable laplacian, along, across;
    std::vector<std::array<std::uint8_t, max_results>> blocks;  // [row][group] that matter from this chord on
};

// Functions of a result on a surface of a curvature, [rank].
const std::vector<ScaledProfile>& profiles_of(const SurfaceBasis& basis, std::size_t result, std::size_t curvature);

// Number of curvatures of a result, and which of them is that of a plane.
std::size_t curvature_count(const SurfaceBasis& basis, std::size_t result);
std::size_t flat_index(const SurfaceBasis& basis, std::size_t result);

// Curvatures of a result, and those of the tables of a group, which are the curvatures of all its results, 1 / metre.
std::vector<double> curvatures_of(const SurfaceBasis& basis, std::size_t result);
std::vector<double> group_curvatures(const SurfaceBasis& basis, std::size_t group);

// Fills a table of a disk (radius 0: a point) up to a chord.
void fill_chord_table(const SurfaceBasis& basis, ChordTable& table, float radius, float end);

// The table of a disk; light from beyond `reach` counts as none. And of a point, from a chord on; functions are left out
// where they have less than the tolerance of the power.
DiskTable make_disk(const SurfaceBasis& basis, float radius, float reach);
PointTable make_point(const SurfaceBasis& basis, float first, float reach, double tolerance);

}  // namespace beamspread
