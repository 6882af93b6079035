// Light that changes slowly over a plane, as the choice of its terms needs it.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/vec.h"
#include "ldf/radial/radial_function.h"

namespace beamspread {

// Rays at some texels.
struct TexelRays {
    std::size_t texels = 0;
    std::vector<Vec3f> travel;  // [ray][texel] unit vectors of the plane frame, z < 0
    std::vector<float> irradiance;  // [ray][texel] mean of the channels, W/m^2; those of a texel add up
};

// Mean squares of moments over the texels of a plane. A moment is the sum over rays of irradiance times a function of the
// angle of incidence times cos(m beta) or sin(m beta), beta the azimuth.
class SmoothLight {
public:
    // Angles, even in tan(theta / 2) from 0 to 1, between which functions count as linear. More: slower.
    static constexpr std::size_t angles = 32;

    // No light.
    SmoothLight();

    // Light from the same directions at all texels; `products`: [direction][direction] mean over texels and channels of
    // products of irradiances, (W/m^2)^2.
    SmoothLight(std::span<const Vec3f> travel, const std::vector<double>& products);

    // Light by two estimates at the same texels with rays of their own: noise is no part of the mean of their products.
    SmoothLight(const TexelRays& first, const TexelRays& second);

    static double half_tangent(std::size_t angle);

    // Adds other light, on texels of its own, times a factor of its squares.
    void add(const SmoothLight& light, double factor);

    // Mean square over texels of the moment of harmonic m with cosine, plus that with sine, (W/m^2)^2. `function`: values at
    // `angles`.
    double squared_moment(std::size_t m, const std::array<double, angles>& function) const;

private:
    double* products(std::size_t m) { return m_products.data() + m * angles * angles; }
    const double* products(std::size_t m) const { return m_products.data() + m * angles * angles; }

    std::vector<double> m_products;  // [m][angle][angle]
};

}  // namespace beamspread
