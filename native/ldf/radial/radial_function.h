// Radial functions with azimuthal harmonics: interface, integrals over texels, and convolution with a disk.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/constants.h"
#include "transport/tally/bins.h"

namespace beamspread {

using Harmonics = std::array<double, harmonic_count>;

// Weights that taper the highest harmonics (von Hann window) of light that needs more than `harmonic_count`. A sharp
// cut would ring and make values negative beside a peak.
inline const Harmonics& harmonic_taper()
{
    static const Harmonics taper = [] {
        constexpr std::size_t half = harmonic_count / 2;
        Harmonics weights;
        weights.fill(1.0);
        for (std::size_t m = half; m < harmonic_count; ++m)
            weights[m] = 0.5 + 0.5 * std::cos(pi * static_cast<double>(m - half) / half);
        return weights;
    }();
    return taper;
}

// The function g(r, phi) = sum over m of c_m(r) cos(m phi), as C_m(r) = integral of c_m(s) s ds from 0 to r. Lengths
// are in mean free paths.
class RadialFunction {
public:
    virtual ~RadialFunction() = default;

    // Number of harmonics: c_m is zero from this m on.
    virtual std::size_t harmonics() const = 0;

    // C_m(r) for every m.
    virtual Harmonics cumulative(double r) const = 0;

    // C_m(infinity) - C_m(r), accurate even if hardly any light is left outside r.
    virtual Harmonics remaining(double r) const = 0;

    // Radius beyond which g is zero.
    virtual double support() const = 0;

    // Radius of an abrupt change of c_m besides the pole; 0 if there is none.
    virtual double edge() const { return 0.0; }

protected:
    RadialFunction() = default;
    RadialFunction(const RadialFunction&) = default;
    RadialFunction(RadialFunction&&) = default;
    RadialFunction& operator=(const RadialFunction&) = default;
    RadialFunction& operator=(RadialFunction&&) = default;
};

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

// Means of c_m(r) cos(m phi) over a disk whose middle is at this distance from the pole and azimuth 0.
Harmonics disk_mean(const RadialFunction& point, double radius, double distance);

// Convolution of an LDF with an evenly lit disk of total weight 1. A disk is symmetric, hence the result has the same
// harmonics; their radial functions are the means of g cos(m phi) over disks, by Green's theorem integrals of
// C_m(r) cos(m phi) d phi around the disks' borders.
class DiskProfile final : public RadialFunction {
public:
    // radius > 0. Keeps the total.
    DiskProfile(const RadialFunction& point, double radius);

    std::size_t harmonics() const override { return m_harmonics; }
    Harmonics cumulative(double r) const override;
    Harmonics remaining(double r) const override;
    double support() const override { return m_radii.back(); }
    double edge() const override { return m_edge; }

private:
    std::size_t m_harmonics;
    double m_edge;
    std::vector<double> m_radii;  // ascending from 0
    std::vector<Harmonics> m_remaining;
    std::vector<Harmonics> m_slope;  // dC_m/dr
};

// Area of the intersection of a disk of this radius around the origin with the rectangle [x0, x1] x [y0, y1].
double disk_overlap(double radius, double x0, double x1, double y0, double y1);

}  // namespace beamspread
