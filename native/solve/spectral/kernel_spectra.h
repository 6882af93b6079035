// Spectra of kernels on the frequencies of a padded plane: of their centres, of their rings, and of both.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fft/fft.h"
#include "solve/separable/low_rank.h"
#include "solve/spectral/padded_plane.h"

namespace beamspread {

// Table of H_m over k for all profiles and m: the two-dimensional Fourier transform of w(r) c_m(r) cos(m phi), with w
// the ring of a window, is i^-m cos(m psi) H_m(k) (Baddour 2009, J. Opt. Soc. Am. A 26, 1767). Lengths are in a unit
// that resolves the ring's detail. The table is wrong beyond the Nyquist frequency and for windows that begin or end
// within less than a unit.
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

// Spectra of few texels, which are integrated exactly (ldf/radial/radial_function.h), minus the rings' part in them.
class CentreSpectrum {
public:
    CentreSpectrum(const PaddedPlane& plane, const KernelCentre& half_width, const std::vector<ScaledProfile>& profiles,
                   const std::optional<RadialWindow>& outside);

    // A sum of terms with the same phase and parity of m.
    struct Sum {
        std::vector<float> texels;  // [x][y] of a quadrant, y in whole blocks; with the sign of the spectrum
        bool sine = false;
        bool odd_m = false;
    };
    Sum add_up(std::span<const KernelTerm> terms) const;

    // Working values of some columns of frequencies, and the sums that they share.
    struct Columns {
        std::vector<const Sum*> sums;
        std::size_t count = 0;
        std::vector<float> cosine;  // [column][x]: 1 or 0, then twice the cosine or sine
        std::vector<float> sine;
        std::vector<float> rows;    // [sum][column][y], summed along x
        std::vector<float> lines;   // of some sums, with mirrored halves added, padded
        std::vector<Complex> half;  // transforms of the lines
    };
    // Prepares the columns kx = 2 pi frequency / padded_width of `count` frequencies, for the sums in `columns`.
    void start(std::size_t first_frequency, std::size_t count, Columns& columns) const;

    // Spectra of sums [first, first + count) in one of the columns, up to the Nyquist frequency of ky, [sum][frequency]
    // (see `KernelSpectra::spectrum`).
    void spectra(Columns& columns, std::size_t column, std::size_t first, std::size_t count, float* values) const;

private:
    void integrate(const ScaledProfile& scaled, const PaddedPlane& plane, const std::optional<RadialWindow>& outside,
                   float* kernels) const;

    std::size_t m_width;   // texels of a quadrant
    std::size_t m_height;
    std::size_t m_stride;  // of y, in whole blocks
    std::size_t m_padded_width;
    std::size_t m_padded_height;
    std::size_t m_frequencies;
    std::vector<float> m_texels;  // [profile][m][phase][x][y], quadrant
};

// The spectra of texel integrals of c_m(r) cos(m phi) and c_m(r) sin(m phi).
//
// Smooth windows divide a kernel into a centre and rings. The centre consists of few texels, which are integrated
// exactly. A ring outside a window of a few texels (or nodes of a coarser grid) has no detail finer than these: its
// spectrum is i^-m cos(m psi) H_m(k), with the Hankel transform H_m in a table over |k|, times the sinc of the texel.
// Spectra on a coarser grid are divided by the transform of the splines, once for the light that they spread and once
// for the luminance that they interpolate ("smooth particle mesh Ewald": Essmann et al. 1995, doi:10.1063/1.470117).
class KernelSpectra {
public:
    KernelSpectra(const Level& level, const std::vector<ScaledProfile>& profiles,
                  const std::optional<RadialWindow>& outside_centre);

    const PaddedPlane& plane() const { return m_plane; }

    // Working values of one column of frequencies, for kernels of some harmonics; reusable for the next column.
    struct Column {
        std::size_t first_m = 0;
        std::size_t first_function = 0;  // column of the table
        std::vector<float> trig;  // [2 (m - first_m) + phase][frequency]: cos, sin (m psi) times the texel's transform
        std::vector<float> hankel;  // [function - first_function][frequency]
        std::vector<float> values;  // of some frequencies
        std::vector<double> k;  // of each frequency, radians per unit
        std::vector<float> cos_psi;
        std::vector<float> sin_psi;
        std::vector<float> cosine;  // of m psi
        std::vector<float> sine;
    };

    // Prepares the column kx = 2 pi frequency / padded_width.
    void start(std::size_t frequency, const HarmonicRange& harmonics, Column& column) const;

    // Terms of a kernel with the same phase and parity of m. The kernel's terms must outlive it.
    struct Part {
        std::span<const KernelTerm> terms;
        CentreSpectrum::Sum centre;

        bool sine() const { return terms.front().phase == Phase::sine; }
        bool odd_m() const { return terms.front().m % 2 == 1; }
    };

    // Divides a kernel, whose terms must be sorted by part.
    std::vector<Part> parts(const std::vector<KernelTerm>& kernel) const;

    // Centres of some parts: values shared by several columns, and spectra of several parts in one column.
    struct Centres {
        CentreSpectrum::Columns columns;
        std::size_t first = 0;  // part
        std::vector<float> spectra;  // [part - first][frequency]
    };
    // Prepares the columns of `count` frequencies kx from the first.
    void start(std::size_t first_frequency, std::size_t count, std::span<const Part* const> parts,
               Centres& centres) const;
    // Selects one of these columns, and parts [first, first + count), for `spectrum`.
    void select(std::size_t column, std::size_t first, std::size_t count, Centres& centres) const;

    // Sum of the terms of the selected part i, for all padded_height frequencies ky; for odd m divided by -i, hence
    // real.
    void spectrum(const Column& column, const Centres& centres, std::size_t i, const Part& part, float* values) const;

private:
    PaddedPlane m_plane;
    std::optional<CentreSpectrum> m_centre;
    std::optional<HankelTable> m_ring;
    std::vector<float> m_texel_y;  // transform of the texel, [frequency]
};

}  // namespace beamspread
