// Radial functions of a surface's basis as tables over chord and curvature.
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

// Values e(c, k) c^2 without unit, for light that comes from a point or a disk. They change slowly with the chord c.
struct ChordTable {
    std::uint32_t first = 0;                   // step of the first row
    std::uint32_t rows = 0;                    // at least 2
    std::vector<AlignedVector<float>> values;  // [result], [curvature][row][block][lane]
};

// Curvatures between which the tables of a result are linear.
struct CurvatureScale {
    static constexpr std::size_t steps = 256;
    std::vector<float> nodes;                    // 1 / metre, ascending
    float per_step = 0.0f;                       // steps per curvature; 0 for a single node
    std::array<std::uint8_t, steps> interval{};  // index of the node before the middle of a step

    std::size_t interval_of(float curvature) const
    {
        const float step = (curvature - nodes.front()) * per_step;
        return interval[static_cast<std::size_t>(step < static_cast<float>(steps - 1) ? step : steps - 1)];
    }
};

// Areas of the samples of a surface, m^2.
struct SampleAreas {
    float least = 0.0f;
    float most = 0.0f;
    float mean = 0.0f;
};

// Kernels of a surface. A sample's light comes from a disk of its area, which keeps the energy for any ratio of the
// area and the medium's spread.
class PairTables {
public:
    // Functions are left out where they have less than the tolerance of the power.
    PairTables(const SurfaceBasis& basis, const SampleAreas& areas, double tolerance);

    // Index of the disk that stands for a sample of this area, m^2.
    std::size_t disk(float area) const;

    // Part of its own light in the radiant exitance of a sample's middle: factors of the moments m = 0, [block][lane].
    void add_self(float area, std::size_t result, float* factors) const;

    // Bounds on the second derivatives of the first function, [row of `point`], 1 / m^4. They don't grow with the chord.
    std::vector<double> second_derivatives(std::size_t result) const;

    std::size_t results = 0;
    std::size_t blocks = 0;
    std::vector<std::int32_t> harmonic;  // [lane]
    std::vector<std::size_t> set;        // [result]
    std::vector<CurvatureScale> scales;  // [result]
    float reach = 0.0f;                  // metres; light farther away counts as none
    std::vector<ChordTable> disks;
    std::vector<float> disk_begin;  // [disk] least chord of other samples, metres: samples do not overlap, disks may
    std::vector<float> disk_end;  // [disk] chord from which its light counts as a point's, metres
    ChordTable point;
    std::vector<std::uint8_t> point_blocks;  // [row of `point`] blocks that matter from this chord on
    ChordTable laplacian;  // of the functions of a point, as c^4 times e'' + e' / c - m^2 e / c^2; rows of `point`

private:
    void make_scales(const SurfaceBasis& basis);
    void make_table(const SurfaceBasis& basis, ChordTable& table, float radius, float end) const;
    void choose_blocks(const SurfaceBasis& basis, double tolerance);
    void make_laplacian(const SurfaceBasis& basis);
    void make_self(const SurfaceBasis& basis, float min_radius, float max_radius);

    float m_first_radius = 1.0f;
    ChordTable m_self;  // over the radius of the sample's disk, one curvature
};

}  // namespace beamspread
