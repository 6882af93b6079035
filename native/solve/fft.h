// Two-dimensional real Fourier transforms: DUCC behind one header.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace beamspread {

using Spectrum = std::vector<std::complex<double>>;

// Transforms of one padded size; the real arrays are (height, width) row by row, the spectra
// (height, width / 2 + 1).
class RealTransform {
public:
    // The smallest fast size of at least the given one.
    RealTransform(std::size_t min_height, std::size_t min_width);

    std::size_t height() const { return m_height; }
    std::size_t width() const { return m_width; }

    Spectrum forward(const std::vector<double>& values) const;

    // Inverse of `forward`, the factor 1 / (height width) included. Overwrites the spectrum.
    std::vector<double> inverse(Spectrum& spectrum) const;

private:
    void transform_columns(Spectrum& spectrum, bool forward) const;

    std::size_t m_height;
    std::size_t m_width;
    std::size_t m_half_width;
};

}  // namespace beamspread
