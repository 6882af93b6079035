#include "transport/exact/quadrature.h"

#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

// A polynomial of high degree swings like the cosine of degree * angle, and Gauss's rule of n nodes is exact for
// products of degree 2 n: this many nodes more than that needs for what is no polynomial. Measured: 8 more change no
// total by 1e-5.
constexpr int spare_nodes = 10;

int node_count(int degree, double angle)
{
    return static_cast<int>(std::ceil(degree * angle / pi)) + spare_nodes;
}

// Gauss-Legendre rule on [0, 1], from the eigenvectors of Jacobi's matrix (Golub, Welsch 1969,
// doi:10.1090/S0025-5718-69-99647-1).
Quadrature gauss_legendre(int count)
{
    Eigen::VectorXd off_diagonal(count - 1);
    for (int k = 1; k < count; ++k)
        off_diagonal(k - 1) = k / std::sqrt(4.0 * k * k - 1.0);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(Eigen::VectorXd::Zero(count), off_diagonal);
    return {0.5 * (solver.eigenvalues().array() + 1.0), solver.eigenvectors().row(0).transpose().array().square()};
}

}  // namespace

Quadrature directions_inside(double ior, int degree)
{
    if (ior == 1.0)
        return gauss_legendre(node_count(degree, pi / 2.0));
    const double critical_angle = std::asin(1.0 / ior);
    const double critical_cosine = std::cos(critical_angle);
    const Quadrature trapped = gauss_legendre(node_count(degree, pi / 2.0 - critical_angle));
    const Quadrature leaving = gauss_legendre(node_count(degree, critical_angle));
    const Eigen::ArrayXd cosine = (1.0 - (1.0 - leaving.cosine.square()) / (ior * ior)).sqrt();
    Quadrature all{Eigen::ArrayXd(trapped.cosine.size() + cosine.size()),
                   Eigen::ArrayXd(trapped.cosine.size() + cosine.size())};
    all.cosine << critical_cosine * trapped.cosine, cosine;
    all.weight << critical_cosine * trapped.weight, leaving.weight * leaving.cosine / (ior * ior * cosine);
    return all;
}

}  // namespace beamspread
