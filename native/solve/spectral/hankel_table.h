// Radial transforms of the harmonics of kernels.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/kernel_term.h"
#include "solve/spectral/radial_window.h"

namespace beamspread {

// The two-dimensional transform of w(r) c_m(r) cos(m phi) is i^-m cos(m psi) H_m(k): H_m of all profiles and m, over k,
// w being the ring of a window. Lengths in a unit that is fine enough for the ring's detail: where the window begins
// and ends over less than that, and beyond the Nyquist frequency, nothing holds.
class HankelTable {
public:
    static constexpr std::size_t no_column = static_cast<std::size_t>(-1);

    HankelTable(const std::vector<ScaledProfile>& profiles, const RadialWindow& window, double unit_m);

    // Columns of harmonics below m, which come first.
    std::size_t columns_below(std::size_t m) const { return m_columns_below[m]; }

    // Place of a harmonic in a row; `no_column` where the profile lacks it.
    std::size_t column(std::size_t profile, std::size_t m) const { return m_column[profile * harmonic_count + m]; }

    // H of `count` columns from `first` on at k radians per unit.
    void row(double k, std::size_t first, std::size_t count, float* values) const;

private:
    void add_profile(const ScaledProfile& scaled, std::size_t index, const RadialWindow& window, double unit_m,
                     std::size_t samples, std::size_t length);

    double m_k_step = 1.0;
    std::size_t m_rows = 0;
    std::size_t m_columns = 0;
    std::vector<std::size_t> m_columns_below;  // [m]
    std::vector<std::size_t> m_column;         // [profile][m]
    std::vector<float> m_table;  // [k][column], the first row for -m_k_step
};

}  // namespace beamspread
