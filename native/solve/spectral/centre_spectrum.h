// Transforms of the texels around the poles of kernels.
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

// Few texels, integrated exactly (ldf/radial/texel_integral.h), less what the rings around bring to them, and transformed by
// sums.
class CentreSpectrum {
public:
    CentreSpectrum(const PaddedPlane& plane, const KernelCentre& half_width, const std::vector<ScaledProfile>& profiles,
                   const std::optional<RadialWindow>& outside);

    // A sum of terms that share their phase and whether m is even.
    struct Sum {
        std::vector<float> texels;  // [x][y] of a quadrant, y in whole blocks; signed as its spectrum
        bool sine = false;
        bool odd_m = false;
    };
    Sum add_up(std::span<const KernelTerm> terms) const;

    // Some columns of frequencies, and sums whose texels are read once for all of them.
    struct Columns {
        std::vector<const Sum*> sums;
        std::size_t count = 0;
        std::vector<float> cosine;  // [column][x]: 1 or 0, then twice the cosine or sine
        std::vector<float> sine;
        std::vector<float> rows;    // [sum][column][y], summed along x
        std::vector<float> lines;   // of some sums, mirrored halves added, padded
        std::vector<Complex> half;  // their transforms
    };
    // For kx = 2 pi frequency / padded_width of `count` frequencies from the first; the sums are those in `columns`.
    void start(std::size_t first_frequency, std::size_t count, Columns& columns) const;

    // Frequencies ky up to that of Nyquist of a sum in one of the columns, see `KernelSpectra::spectrum`; not of
    // wide centres.
    void spectrum(const Columns& columns, std::size_t column, std::size_t sum, float* values) const;

    // The same of sums [first, first + count), [sum][frequency]: the way for wide centres, whose rows are transformed.
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
