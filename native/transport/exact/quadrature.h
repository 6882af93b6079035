// Directions inside a medium as a quadrature rule.
#pragma once

#include <Eigen/Dense>

namespace beamspread {

// Integral over the cosine from 0 to 1 as a sum over nodes.
struct Quadrature {
    Eigen::ArrayXd cosine;
    Eigen::ArrayXd weight;
};

// For radiance inside a medium of this refractive index, resolving Legendre polynomials up to `degree`: Gauss's rule,
// in two pieces where there is a critical angle. Beyond it the variable is the cosine outside, in which what leaves is
// smooth.
Quadrature directions_inside(double ior, int degree);

}  // namespace beamspread
