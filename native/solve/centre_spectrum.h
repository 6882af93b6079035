// Transforms of the texels around the poles of kernels.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "solve/kernel_term.h"
#include "solve/padded_plane.h"
#include "solve/radial_window.h"

namespace beamspread {

// Few texels, integrated exactly (ldf/texel_integral.h), less what the rings around bring to them, and transformed by
// sums.
class CentreSpectrum {
public:
    CentreSpectrum(const PaddedPlane& plane, const KernelCentre& half_width, const std::vector<ScaledProfile>& profiles,
                   const std::optional<RadialWindow>& outside);

    // What a column of frequencies shares, per texel along x: 1 or 0, then twice the cosine or sine.
    struct Column {
        std::vector<double> cosine;
        std::vector<double> sine;
    };
    void start(std::size_t frequency, Column& column) const;

    // The sum of terms that share their phase and whether m is even, [x][y] of a quadrant.
    std::vector<float> add_up(std::span<const KernelTerm> terms) const;

    // Frequencies ky up to that of Nyquist of such a sum, see `KernelSpectra::spectrum`.
    void spectrum(const Column& column, const std::vector<float>& sum, bool sine, bool odd_m, float* values) const;

private:
    void integrate(const ScaledProfile& scaled, const PaddedPlane& plane, const std::optional<RadialWindow>& outside,
                   float* kernels) const;

    std::size_t m_width;   // texels of a quadrant
    std::size_t m_height;
    std::size_t m_padded_width;
    std::size_t m_frequencies;
    std::vector<float> m_texels;  // [profile][m][phase][x][y], quadrant
    std::vector<float> m_trig;    // [cos, sin][y][frequency]
};

}  // namespace beamspread
