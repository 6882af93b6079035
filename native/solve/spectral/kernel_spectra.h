// Fourier transforms of kernels, without transforming kernels.
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

// The spectra of texel integrals of c_m(r) cos(m phi) and c_m(r) sin(m phi), on the frequencies of a padded plane.
//
// A kernel is cut by smooth windows. The ring outside a window a few texels wide has no detail finer than texels, and
// what is farther than a few steps of a coarser grid none finer than that: its spectrum is i^-m cos(m psi) H_m(k), a
// table of one Hankel transform in |k|, times the sinc of the texel. Inside are few texels, integrated exactly. Spectra
// on a coarser grid bring its light's splines back to texels, and do so once more for what is read off that grid
// ("smooth particle mesh Ewald": Essmann et al. 1995, doi:10.1063/1.470117).
class KernelSpectra {
public:
    KernelSpectra(const Level& level, const std::vector<ScaledProfile>& profiles,
                  const std::optional<RadialWindow>& outside_centre);

    const PaddedPlane& plane() const { return m_plane; }

    // What one column of frequencies needs for kernels of some harmonics; use it again for the next one.
    struct Column {
        std::size_t first_m = 0;
        std::size_t first_function = 0;  // column of the table
        std::vector<float> trig;  // [2 (m - first_m) + phase][frequency]: cos, sin (m psi) times the texel's transform
        std::vector<float> hankel;  // [function - first_function][frequency]
        std::vector<float> values;  // of some frequencies
        std::vector<double> k;  // of each frequency, per unit
        std::vector<float> cos_psi;
        std::vector<float> sin_psi;
        std::vector<float> cosine;  // of m psi
        std::vector<float> sine;
    };

    // For kx = 2 pi frequency / padded_width.
    void start(std::size_t frequency, const HarmonicRange& harmonics, Column& column) const;

    // Terms of a kernel that share their phase and whether m is even; the kernel's terms must outlive it.
    struct Part {
        std::span<const KernelTerm> terms;
        CentreSpectrum::Sum centre;

        bool sine() const { return terms.front().phase == Phase::sine; }
        bool odd_m() const { return terms.front().m % 2 == 1; }
    };

    // A kernel's terms must be sorted so that those of a part follow each other.
    std::vector<Part> parts(const std::vector<KernelTerm>& kernel) const;

    // The centres of some parts: what is read once for several columns, and the spectra of several parts of one column.
    struct Centres {
        CentreSpectrum::Columns columns;
        std::size_t column = 0;
        std::size_t first = 0;  // part
        std::vector<float> spectra;  // [part - first][frequency], of wide centres
    };
    // For `count` frequencies kx from the first.
    void start(std::size_t first_frequency, std::size_t count, std::span<const Part* const> parts,
               Centres& centres) const;
    // One of these columns, and parts [first, first + count), for `spectrum`.
    void select(std::size_t column, std::size_t first, std::size_t count, Centres& centres) const;

    // The sum of the terms of part i of those selected, for all padded_height frequencies ky; for odd m divided by -i,
    // hence real.
    void spectrum(const Column& column, const Centres& centres, std::size_t i, const Part& part, float* values) const;

private:
    PaddedPlane m_plane;
    std::optional<CentreSpectrum> m_centre;
    std::optional<HankelTable> m_ring;
    std::vector<float> m_texel_y;  // of each frequency: the transform of the texel
};

}  // namespace beamspread
