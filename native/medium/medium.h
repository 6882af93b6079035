// A homogeneous, plane-parallel, dimensionless medium (lengths are in mean free paths): its phase function and the
// Fresnel reflection and refraction at its smooth boundary (Born, Wolf 1999, Sec. 1.5.2, doi:10.1017/CBO9781139644181).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/constants.h"

namespace beamspread {

struct Medium {
    double g = 0.8;  // Henyey-Greenstein anisotropy, in [-0.99, 0.99]
    double ior = 1.0;  // refractive index inside over outside, in [1, 3]
    double thickness = std::numeric_limits<double>::infinity();  // in mean free paths; infinite: half-space

    bool is_half_space() const { return thickness == std::numeric_limits<double>::infinity(); }

    friend bool operator==(const Medium&, const Medium&) = default;
};

// Throws InvalidArgument for a medium that the simulation does not cover.
void validate(const Medium& medium);

// Throws InvalidArgument unless the single-scattering albedo is in [0, 1).
void check_albedo(double albedo);

// Henyey-Greenstein phase function (Henyey, Greenstein 1941, doi:10.1086/144246): density per steradian of a deflection
// with cosine cos_theta.
inline double henyey_greenstein_pdf(double cos_theta, double g)
{
    const double denominator = 1.0 + g * g - 2.0 * g * cos_theta;
    return inv_pi / 4.0 * (1.0 - g * g) / (denominator * std::sqrt(denominator));
}

// Cosine of a deflection, by inverting the distribution function at u in [0, 1).
inline double henyey_greenstein_sample(double g, double u)
{
    // Below this |g| the formula's cancellation error exceeds the error of isotropic scattering.
    if (std::abs(g) < 1e-4)
        return 1.0 - 2.0 * u;
    const double ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    return std::clamp((1.0 + g * g - ratio * ratio) / (2.0 * g), -1.0, 1.0);
}

// Fresnel reflectance for cos_theta_i in [0, 1] on the side of incidence; 1 for total internal reflection. `eta` is the
// refractive index behind the boundary over the index before it.
inline double fresnel(double cos_theta_i, double eta)
{
    if (eta == 1.0)
        return 0.0;
    const double sin2_theta_t = (1.0 - cos_theta_i * cos_theta_i) / (eta * eta);
    if (sin2_theta_t >= 1.0)
        return 1.0;
    const double cos_theta_t = std::sqrt(1.0 - sin2_theta_t);
    const double r_parallel = (eta * cos_theta_i - cos_theta_t) / (eta * cos_theta_i + cos_theta_t);
    const double r_perpendicular = (cos_theta_i - eta * cos_theta_t) / (cos_theta_i + eta * cos_theta_t);
    return 0.5 * (r_parallel * r_parallel + r_perpendicular * r_perpendicular);
}

// Snell's law: angle inside the medium (radians) of light that arrives at `theta` (radians) outside.
inline double refracted_angle(double theta, double ior)
{
    return std::asin(std::min(1.0, std::sin(theta) / ior));
}

}  // namespace beamspread
