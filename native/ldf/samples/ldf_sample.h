// One LDF as an image, from a library or from the file of another simulator, and its angular space.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/vec.h"

namespace beamspread {

inline constexpr std::size_t max_sample_side = 16384;

// Lengths are in mean free paths. The beam travels toward +u; O, where its axis enters, is the centre of the image.
struct LdfSample {
    std::size_t width = 0;
    std::size_t height = 0;
    std::vector<float> image;  // mean exitance of each texel per unit incident power, 1/mfp^2; rows v upward, columns u
    double pitch = 1.0;  // side of a texel
    double angle_deg = 0.0;  // of incidence
    double albedo = 0.0;  // of single scattering
    double beam_diameter = 0.0;  // of the disk that the beam lights on the surface; 0: a pencil beam
    std::optional<double> g;  // anisotropy of the medium, if known

    float at(std::size_t y, std::size_t x) const { return image[y * width + x]; }

    // Coordinates of a texel's centre.
    double u(std::size_t x) const { return (static_cast<double>(x) + 0.5 - 0.5 * static_cast<double>(width)) * pitch; }
    double v(std::size_t y) const { return (static_cast<double>(y) + 0.5 - 0.5 * static_cast<double>(height)) * pitch; }

    // Power that leaves within the image, per unit power incident.
    double power() const;
};

// Exitance at a point (u, v): bilinear between the centres of texels, constant outside, as an LDF does not end with its
// image.
double exitance_at(const LdfSample& sample, const Vec2& point);

// Throws InvalidArgument unless the exitance is finite and not negative. Undershoots of up to 10 % of the brightest
// texel are allowed: truncated harmonics (`ldf_image`) and denoised simulations have them.
void validate(const LdfSample& sample);

// Write and read a one-part OpenEXR file; ldf_sample.cpp describes the layout. Throw IoError.
void save_sample(const LdfSample& sample, const std::filesystem::path& path);
LdfSample load_sample(const std::filesystem::path& path);

struct AngularCoordinates {
    double phi = 0.0;  // [0, 2 pi)
    double psi = 0.0;  // [0, pi/2)
};

// Directions to points P of the plane from the reference point Q, at `height` above the brightest point H. psi is the
// angle at Q between the normal and the direction to P, phi the azimuth of P around H from the beam's direction of
// travel:
//   P = H + height tan(psi) (cos phi, sin phi).
// The paper's text defines phi as the angle at P between the directions to O and H. That angle is 0 everywhere at
// normal incidence, while the paper's Fig. 4 shows phi from 0 to 2 pi; this class therefore takes the azimuth. The
// origin O takes no part in the maps; H - O is the shift of the brightest point. At H, phi is 0.
class AngularSpace {
public:
    // height > 0. Throws InvalidArgument.
    AngularSpace(const Vec2& origin, const Vec2& brightest, double height);

    AngularCoordinates to_angular(const Vec2& point) const;

    // Throws InvalidArgument unless 0 <= psi < pi/2.
    Vec2 to_planar(const AngularCoordinates& at) const;

    const Vec2& origin() const { return m_origin; }
    const Vec2& brightest() const { return m_brightest; }
    double height() const { return m_height; }

private:
    Vec2 m_origin;
    Vec2 m_brightest;
    double m_height;
};

// Brightest point H of Manabe et al. 2012 (Sec. 3.2), in mean free paths from O. An LDF is even in v, hence H lies on
// v = 0 and the image's odd part is noise. The even part is smoothed until the noise is below 1 % of the peak. H is the
// vertex of a paraboloid fitted to the top of the peak: the texels connected with the brightest one that have at least
// 95 % of its value. A peak beside O that the texels do not resolve, as a pencil beam's, is at O.
Vec2 brightest_point(const LdfSample& sample);

}  // namespace beamspread
