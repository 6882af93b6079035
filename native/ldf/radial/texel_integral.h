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

// Integrals over each texel of c_m(r) cos(m phi) and c_m(r) sin(m phi), [m][i][j], for the harmonics that the profile
// uses.
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

// Throws InvalidArgument for a pitch whose texels double and single precision can't resolve: below 1e-6 mean free paths
// differences between the borders of a texel lose more than 1e-5 of it, and beyond 1e18 exitance per texel is no normal
// float.
void check_pitch(double pitch);

// By Green's theorem the integral over a texel is that of C_m(r) cos(m phi) d phi around its border.
// Every border is shared by two texels, so the sum over texels telescopes: no energy is lost or
// doubled for any ratio of mean free path and pitch.
TexelIntegrals integrate_texels(const RadialFunction& profile, const TexelGrid& grid);

}  // namespace beamspread
