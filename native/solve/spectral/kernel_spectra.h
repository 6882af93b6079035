// Spectra of kernels on the frequencies of a padded plane, from Hankel transforms of their harmonics.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "solve/separable/kernel_term.h"
#include "solve/spectral/centre_spectrum.h"
#include "solve/spectral/hankel_table.h"
#include "solve/spectral/padded_plane.h"

namespace beamspread {

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
        std::size_t column = 0;
        std::size_t first = 0;  // part
        std::vector<float> spectra;  // [part - first][frequency], of wide centres
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
