// Exact integrals of an LDF over the texels of a regular grid.
#pragma once

#include <cstddef>
#include <vector>

#include "ldf/radial/radial_function.h"

namespace beamspread {

// Texel (i, j) is [x0 + j pitch_x, x0 + (j + 1) pitch_x] x [y0 + i pitch_y, ...] around the pole of
// (r, phi), lengths in mean free paths.
struct TexelGrid {
    double x0 = 0.0;
    double y0 = 0.0;
    double pitch_x = 1.0;
    double pitch_y = 1.0;
    std::size_t width = 0;
    std::size_t height = 0;
};

// Integrals over each texel of c_m(r) cos(m phi) and c_m(r) sin(m phi), [m][i][j], for the profile's harmonics.
struct TexelIntegrals {
    std::size_t harmonics = 0;
    std::vector<double> cosine;
    std::vector<double> sine;

    TexelIntegrals() = default;
    TexelIntegrals(std::size_t used, std::size_t texels)
        : harmonics(used), cosine(harmonics * texels), sine(harmonics * texels)
    {
    }
};

// Throws InvalidArgument for a pitch (mean free paths) outside [1e-6, 1e18]. Below, differences between a texel's
// borders lose more than 1e-5 to rounding; above, a texel's exitance is no normal float.
void check_pitch(double pitch);

// Computes the integrals by Green's theorem: the integral of g over a texel is that of C_m(r) cos(m phi) d phi around
// its border. Two texels share each border, hence the sum over texels telescopes and conserves energy for any ratio of
// mean free path and pitch.
TexelIntegrals integrate_texels(const RadialFunction& profile, const TexelGrid& grid);

}  // namespace beamspread
