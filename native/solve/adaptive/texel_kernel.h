// What one texel's beam adds to every texel around it, as a table.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/radial/radial_profile.h"
#include "ldf/radial/texel_integral.h"

namespace beamspread {

// Values for offsets -reach .. reach from the lit texel, rows upward.
class KernelTable {
public:
    KernelTable() = default;
    KernelTable(std::ptrdiff_t reach_y, std::ptrdiff_t reach_x);

    std::ptrdiff_t reach_y() const { return m_reach_y; }
    std::ptrdiff_t reach_x() const { return m_reach_x; }
    std::size_t size() const { return m_values.size(); }

    // The value at dx = 0; dx may be negative.
    double* row(std::ptrdiff_t dy) { return m_values.data() + (dy + m_reach_y) * stride() + m_reach_x; }
    const double* row(std::ptrdiff_t dy) const { return m_values.data() + (dy + m_reach_y) * stride() + m_reach_x; }

private:
    std::ptrdiff_t stride() const { return 2 * m_reach_x + 1; }

    std::ptrdiff_t m_reach_y = 0;
    std::ptrdiff_t m_reach_x = 0;
    std::vector<double> m_values{0.0};
};

// A combination of harmonics of one profile: the sum over m of c_m(r) (cosine[m] cos(m phi) + sine[m] sin(m phi)).
struct HarmonicSum {
    Harmonics cosine{};
    Harmonics sine{};
};

// Tables of one profile's kernels: the power in each texel, sides in mean free paths. Exact within `near` texels of the
// pole; farther out exact in blocks of 3, 9, 27 ... texels, each exact within `near` blocks, whose power is handed to
// their texels by polynomials: no power is lost, and values are off by less than the profile's own noise.
class TexelKernels {
public:
    TexelKernels(const RadialProfile& profile, double pitch_x, double pitch_y, std::ptrdiff_t reach_y,
                 std::ptrdiff_t reach_x, std::ptrdiff_t near);

    KernelTable table(const HarmonicSum& harmonics) const;

private:
    // Blocks of 3^n texels, and their integrals near the pole.
    struct Level {
        std::ptrdiff_t reach_y = 0;
        std::ptrdiff_t reach_x = 0;
        std::size_t height = 0;  // of the quadrant that is integrated
        std::size_t width = 0;
        TexelIntegrals integrals;
    };

    static void integrate(const Level& level, const HarmonicSum& harmonics, KernelTable& table);
    static void refine(const KernelTable& coarse, KernelTable& table);

    std::vector<Level> m_levels;  // finest first
};

}  // namespace beamspread
