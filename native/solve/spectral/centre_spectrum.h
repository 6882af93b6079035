// Spectra of the centres of kernels: the texels around their poles.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "fft/fft.h"
#include "solve/separable/kernel_term.h"
#include "solve/spectral/padded_plane.h"
#include "solve/spectral/radial_window.h"

namespace beamspread {

// Spectra of few texels, which are integrated exactly (ldf/radial/texel_integral.h), minus the rings' part in them.
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

    // Spectrum of a sum in one of the columns, up to the Nyquist frequency of ky (see `KernelSpectra::spectrum`). Not
    // for wide centres.
    void spectrum(const Columns& columns, std::size_t column, std::size_t sum, float* values) const;

    // Spectra of sums [first, first + count), [sum][frequency], by transforms of rows: for wide centres.
    void spectra(Columns& columns, std::size_t column, std::size_t first, std::size_t count, float* values) const;
    bool is_wide() const { return m_trig.empty(); }

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
    std::vector<float> m_trig;    // [cos, sin][y][frequency]; empty: wide
};

}  // namespace beamspread
