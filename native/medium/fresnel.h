// Reflection and refraction of unpolarized light at a smooth dielectric boundary (Born, Wolf 1999, Sec. 1.5.2,
// doi:10.1017/CBO9781139644181).
#pragma once

#include <algorithm>
#include <cmath>

namespace beamspread {

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
