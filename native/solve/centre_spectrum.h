// Transforms of the texels around the poles of kernels.
#pragma once

#include <cstddef>
#include <optional>
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

    // Frequencies ky up to that of Nyquist, see `KernelSpectra::spectrum`.
    void spectrum(const Column& column, const KernelTerm* terms, std::size_t count, float* values) const;

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
