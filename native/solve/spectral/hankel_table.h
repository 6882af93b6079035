// Hankel transforms of the harmonics of kernels.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/separable/kernel_term.h"
#include "solve/spectral/radial_window.h"

namespace beamspread {

// Table of H_m over k for all profiles and m: the two-dimensional Fourier transform of w(r) c_m(r) cos(m phi), with w
// the ring of a window, is i^-m cos(m psi) H_m(k). Lengths are in a unit that resolves the ring's detail. The table is
// wrong beyond the Nyquist frequency and for windows that begin or end within less than a unit.
class HankelTable {
public:
    static constexpr std::size_t no_column = static_cast<std::size_t>(-1);

    HankelTable(const std::vector<ScaledProfile>& profiles, const RadialWindow& window, double unit_m);

    // Number of columns of harmonics below m, which come first.
    std::size_t columns_below(std::size_t m) const { return m_columns_below[m]; }

    // Column of a profile's harmonic; `no_column` if the profile lacks it.
    std::size_t column(std::size_t profile, std::size_t m) const { return m_column[profile * harmonic_count + m]; }

    // H_m(k) of columns [first, first + count), k in radians per unit.
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
