// Radial functions of a surface's basis as tables over chord and curvature.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "solve/surface/chord_table.h"
#include "solve/surface/lattice_excess.h"
#include "solve/surface/surface_kernels.h"
#include "solve/surface/uneven_sample.h"

namespace beamspread {

// Curvatures between which the tables of a group are linear.
struct CurvatureScale {
    static constexpr std::size_t steps = 1024;
    std::vector<float> nodes;                    // 1 / metre, ascending
    std::vector<float> per_width;                // [interval] 1 / its width, metres
    std::size_t middle = 0;                      // index of the node next to 0 between two others; 0: none
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
    float most_uneven = 0.0f;  // longest side of the texel of an uneven sample, metres
};

// Kernels of a surface. A sample's light comes from a disk of its area, which keeps the energy for any ratio of the
// area and the medium's spread.
class PairTables {
public:
    PairTables(SurfaceKernels& kernels, const SampleAreas& areas);

    // Index of the disk that stands for a sample of this area, m^2.
    std::size_t disk(float area) const;

    // Adds the radiant exitance of a sample's middle by its own light, [result]. On even lattices of samples, the sum of
    // all light is then that of a plane. `neighbors`: mean index of the disks beside it.
    void add_self_light(float area, float neighbors, const LatticeShape& lattice, const float* moments,
                        float* sums) const;

    // The same of a sample whose neighbors are no lattice. Its rings begin at `first_ring` or later.
    void add_uneven_light(const UnevenRings& rings, const float* moments, float* sums) const;
    std::uint32_t first_ring() const { return m_within.first; }

    // Bounds on the second derivatives of the first function, [row of the point], 1 / m^4. They don't grow with the chord.
    std::vector<double> second_derivatives(std::size_t result) const;

    PairLanes lanes;
    std::vector<CurvatureScale> scales;  // [group]
    float least_curvature = 0.0f;  // of result 0, 1 / metre; pairs below bend more than its LDFs
    float most_curvature = 0.0f;
    float reach = 0.0f;                  // metres; light farther away counts as none
    std::vector<std::shared_ptr<const DiskTable>> disks;  // ascending
    std::shared_ptr<const PointTable> point;

private:
    void make_scales(const SurfaceBasis& basis);
    void make_self(const SurfaceBasis& basis, float min_radius, float max_radius);
    void make_within(const SurfaceBasis& basis, float most_uneven);
    double place_of(float radius) const;

    double m_disk_step = 1.0;  // between disks, octaves of the radius
    ChordTable m_self;  // light within a sample's disk, over its radius; one curvature
    ChordTable m_within;  // the same of one direction, for rings around uneven samples
};

}  // namespace beamspread
