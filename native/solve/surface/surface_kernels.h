// Kernels of a medium for surfaces of any shape, kept from surface to surface.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "solve/surface/chord_table.h"
#include "solve/surface/surface_basis.h"

namespace beamspread {

// The media and the samples that kernels of a surface are made for.
struct KernelChoice {
    std::vector<ChannelMedium> channels;
    double max_angle_deg = 90.0;
    double texel = 1.0;  // root of the samples' mean area, metres
    bool is_colored = false;
    double tolerance = 1e-3;
};

// The basis of a medium and its tables, which are made where they are first asked for. Values don't depend on which
// others exist. Several threads may ask at once.
class SurfaceKernels {
public:
    // Numbers of radii of disks are their binary logarithms in metres times this. Larger: disks closer to samples, less
    // that surfaces share.
    static constexpr int radii_per_octave = 32;

    explicit SurfaceKernels(const KernelChoice& choice);

    // The kernels of a choice, made anew or kept from an earlier one. Those used last are kept, in bounded memory.
    static std::shared_ptr<SurfaceKernels> recent(const KernelChoice& choice);

    const SurfaceBasis& basis() const { return m_basis; }
    float reach() const { return m_reach; }  // metres; light farther away counts as none

    std::shared_ptr<const DiskTable> disk(int number);
    std::shared_ptr<const PointTable> point(int octave);  // from 2^octave metres on

    std::size_t bytes() const;

private:
    double m_tolerance;
    SurfaceBasis m_basis;
    float m_reach = 0.0f;
    mutable std::mutex m_lock;
    std::map<int, std::shared_ptr<const DiskTable>> m_disks;
    std::map<int, std::shared_ptr<const PointTable>> m_points;
};

}  // namespace beamspread
