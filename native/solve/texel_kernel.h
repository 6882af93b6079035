// What one texel's beam adds to every texel around it, as a table.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "ldf/radial_profile.h"

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

// The kernel's power in each texel, sides in mean free paths. Exact within `near` texels of the pole; farther out
// exact in blocks of 3, 9, 27 ... texels, each exact within `near` blocks, whose power is handed to their texels by
// polynomials: no power is lost, and values are off by less than the profile's own noise.
KernelTable texel_kernel(const RadialProfile& profile, const HarmonicSum& harmonics, double pitch_x, double pitch_y,
                         std::ptrdiff_t reach_y, std::ptrdiff_t reach_x, std::ptrdiff_t near);

}  // namespace beamspread
