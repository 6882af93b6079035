// Adding-doubling on radiance averaged over the azimuth, with a quadrature of cosines inside the medium (van de Hulst
// 1980, "Multiple Light Scattering"; Prahl, van Gemert, Welch 1993, doi:10.1364/AO.32.000559).
//
// By reciprocity, the totals of a beam equal the radiance that the medium returns toward it under uniform diffuse
// light. One vector of incident light therefore serves all beams; each beam adds a row to the matrices, a direction
// that light leaves by and that does not feed back into the others.
#include "transport/exact/exact_totals.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"
#include "medium/medium.h"

namespace beamspread {

namespace {

using Eigen::ArrayXd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Legendre coefficient g^l of the phase function at which the series ends, within bounds on its length. A smaller
// coefficient or longer series: smaller errors (`exact_totals_error`), more time.
constexpr double negligible_coefficient = 1.4e-3;
constexpr int min_coefficients = 40;
constexpr int max_coefficients = 192;

// Thickness of the first layer over the smallest cosine. Its relative error is a twelfth of the square.
constexpr double first_layer = 0.02;

// Largest transmission between two directions of the quadrature at which a layer counts as a half-space; the effect on
// its reflectance is the square. Larger: larger errors, hardly less time.
constexpr double opaque = 1e-6;

int coefficient_count(double g)
{
    if (g == 0.0)
        return min_coefficients;
    const double count = std::log(negligible_coefficient) / std::log(std::abs(g));
    return static_cast<int>(std::clamp(count, double{min_coefficients}, double{max_coefficients}));
}

// Values of P_0 .. P_{count - 1} at each x, [l][x].
MatrixXd legendre(int count, const ArrayXd& x)
{
    MatrixXd p(count, x.size());
    p.row(0).setOnes();
    p.row(1) = x.matrix().transpose();
    for (int l = 2; l < count; ++l)
        p.row(l) = ((2.0 * l - 1.0) * x.transpose() * p.row(l - 1).array() - (l - 1.0) * p.row(l - 2).array()) / l;
    return p;
}

// Phase matrices from the directions of the columns to those of the rows, without albedo, with the column's quadrature
// weight.
struct Scattering {
    MatrixXd forward;   // up to up, and down to down
    MatrixXd backward;  // down to up, and up to down
};

// The problem apart from the albedo.
struct Angular {
    ArrayXd cosine;  // of the quadrature
    ArrayXd beam_cosine;  // inside, of the beams
    Scattering among;  // the quadrature's directions
    Scattering to_beams;  // from the quadrature's directions
    double peak = 0.0;  // part of the phase function that counts as unscattered
    ArrayXd reflectance;  // at the boundary, from inside
    ArrayXd beam_reflectance;
};

// Integral over the cosine from 0 to 1 as a sum over nodes.
struct Quadrature {
    ArrayXd cosine;
    ArrayXd weight;
};

// Nodes beyond those that polynomials need, for the radiance, which is not one. More: smaller errors, more time.
constexpr int spare_nodes = 10;

// A polynomial of high degree oscillates like the cosine of degree * angle, and n Gauss nodes integrate products of
// degree 2 n exactly.
int node_count(int degree, double angle)
{
    return static_cast<int>(std::ceil(degree * angle / pi)) + spare_nodes;
}

// Gauss-Legendre rule on [0, 1], from the eigenvectors of Jacobi's matrix (Golub, Welsch 1969,
// doi:10.1090/S0025-5718-69-99647-1).
Quadrature gauss_legendre(int count)
{
    VectorXd off_diagonal(count - 1);
    for (int k = 1; k < count; ++k)
        off_diagonal(k - 1) = k / std::sqrt(4.0 * k * k - 1.0);
    Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
    solver.computeFromTridiagonal(VectorXd::Zero(count), off_diagonal);
    return {0.5 * (solver.eigenvalues().array() + 1.0), solver.eigenvectors().row(0).transpose().array().square()};
}

// Quadrature of radiance inside a medium of this refractive index that resolves Legendre polynomials up to `degree`.
// Gauss rules on both sides of the critical angle; inside the cone that leaves, the variable is the cosine outside, in
// which the leaving radiance is smooth.
Quadrature directions_inside(double ior, int degree)
{
    if (ior == 1.0)
        return gauss_legendre(node_count(degree, pi / 2.0));
    const double critical_angle = std::asin(1.0 / ior);
    const double critical_cosine = std::cos(critical_angle);
    const Quadrature trapped = gauss_legendre(node_count(degree, pi / 2.0 - critical_angle));
    const Quadrature leaving = gauss_legendre(node_count(degree, critical_angle));
    const ArrayXd cosine = (1.0 - (1.0 - leaving.cosine.square()) / (ior * ior)).sqrt();
    Quadrature all{ArrayXd(trapped.cosine.size() + cosine.size()), ArrayXd(trapped.cosine.size() + cosine.size())};
    all.cosine << critical_cosine * trapped.cosine, cosine;
    all.weight << critical_cosine * trapped.weight, leaving.weight * leaving.cosine / (ior * ior * cosine);
    return all;
}

Angular angular_problem(const Medium& medium, std::span<const double> angles_deg)
{
    Angular a;
    const int count = coefficient_count(medium.g);
    const Quadrature quadrature = directions_inside(medium.ior, count);
    a.cosine = quadrature.cosine;
    a.beam_cosine.resize(static_cast<Eigen::Index>(angles_deg.size()));
    for (Eigen::Index j = 0; j < a.beam_cosine.size(); ++j)
        a.beam_cosine(j) =
            std::cos(refracted_angle(angles_deg[static_cast<std::size_t>(j)] * radians_per_degree, medium.ior));
    const auto from_inside = [&](double c) { return fresnel(c, 1.0 / medium.ior); };
    a.reflectance = a.cosine.unaryExpr(from_inside);
    a.beam_reflectance = a.beam_cosine.unaryExpr(from_inside);

    // Compute the fraction `peak` of scattered light that counts as unscattered, by the delta-M method (Wiscombe 1977,
    // doi:10.1175/1520-0469(1977)034<1408:TDMRYA>2.0.CO;2): the forward peak beyond the last coefficient.
    a.peak = medium.g > 0.0 ? std::pow(medium.g, count) : 0.0;
    const MatrixXd p = legendre(count, a.cosine);
    const MatrixXd p_beams = legendre(count, a.beam_cosine);
    ArrayXd even(count), odd(count);
    for (int l = 0; l < count; ++l) {
        const double coefficient = (2.0 * l + 1.0) * (std::pow(medium.g, l) - a.peak) / (1.0 - a.peak);
        even(l) = coefficient;
        odd(l) = l % 2 == 0 ? coefficient : -coefficient;
    }
    const VectorXd half_weight = 0.5 * quadrature.weight.matrix();
    const auto kernel = [&](const MatrixXd& to, const ArrayXd& coefficients) -> MatrixXd {
        return to.transpose() * coefficients.matrix().asDiagonal() * p * half_weight.asDiagonal();
    };
    a.among = {kernel(p, even), kernel(p, odd)};
    a.to_beams = {kernel(p_beams, even), kernel(p_beams, odd)};
    // Renormalize the phase function: its quadrature error counts as unscattered too, which conserves energy (Grant,
    // Hunt 1969, Proc. R. Soc. Lond. A 313, 183).
    const VectorXd lost =
        VectorXd::Ones(a.cosine.size()) - a.among.forward.rowwise().sum() - a.among.backward.rowwise().sum();
    a.among.forward.diagonal() += lost;
    return a;
}

// Response of a homogeneous layer without boundaries: leaving radiance per arriving radiance.
struct Layer {
    ArrayXd depth, beam_depth;           // optical depth along each direction
    ArrayXd direct, beam_direct;         // unscattered transmission: exp(-depth)
    MatrixXd reflected, beam_reflected;  // from the quadrature's directions to themselves and to the beams
    MatrixXd scattered, beam_scattered;  // the same on the far side
};

// Thin layer by diamond initialization, which conserves energy exactly: radiance inside is the mean of the two sides
// (Wiscombe 1976, J. Quant. Spectrosc. Radiat. Transfer 16, 637).
Layer thin_layer(const Angular& a, double albedo, double thickness)
{
    const Eigen::Index n = a.cosine.size();
    const ArrayXd m = 0.5 * thickness / a.cosine;
    const ArrayXd m_beam = 0.5 * thickness / a.beam_cosine;
    const MatrixXd forward = (albedo * m).matrix().asDiagonal() * a.among.forward;
    const MatrixXd backward = (albedo * m).matrix().asDiagonal() * a.among.backward;
    const MatrixXd identity = MatrixXd::Identity(n, n);

    MatrixXd across = identity - forward;
    across.diagonal() += m.matrix();
    const MatrixXd x = backward * across.inverse();
    const MatrixXd g = (across - x * backward).inverse();
    Layer layer;
    layer.depth = m.log1p() - (-m).log1p();
    layer.direct = (1.0 - m) / (1.0 + m);
    layer.reflected = 2.0 * g * x;
    layer.scattered = (2.0 / (1.0 + m)).matrix().asDiagonal() * (forward + x * backward) * g;
    // Compute the beams' rows from the mean radiance within the layer.
    MatrixXd down = 0.5 * (identity + layer.scattered);
    down.diagonal() += 0.5 * layer.direct.matrix();
    const MatrixXd up = 0.5 * layer.reflected;
    const auto factor = (2.0 * albedo * m_beam / (1.0 + m_beam)).matrix().asDiagonal();
    layer.beam_depth = m_beam.log1p() - (-m_beam).log1p();
    layer.beam_direct = (1.0 - m_beam) / (1.0 + m_beam);
    layer.beam_reflected = factor * (a.to_beams.forward * up + a.to_beams.backward * down);
    layer.beam_scattered = factor * (a.to_beams.forward * down + a.to_beams.backward * up);
    return layer;
}

// Doubles a layer (van de Hulst 1980, Sec. 4.3). Unscattered light stays separate: differences from it would lose the
// digits of thin layers.
Layer doubled(const Layer& layer)
{
    const auto direct = layer.direct.matrix().asDiagonal();
    const auto beam_direct = layer.beam_direct.matrix().asDiagonal();
    const MatrixXd& r = layer.reflected;
    const MatrixXd& t = layer.scattered;
    // Compute the scattered radiance between the two layers, down and up.
    const MatrixXd twice = r * r;
    MatrixXd between = -twice;
    between.diagonal().array() += 1.0;
    const MatrixXd down = t + between.partialPivLu().solve(twice * t + twice * direct);
    const MatrixXd up = r * down + r * direct;
    const MatrixXd beam_up = layer.beam_reflected * down + layer.beam_reflected * direct;
    const MatrixXd beam_down = layer.beam_scattered + layer.beam_reflected * up;
    Layer both;
    // Double the depth and not the transmission: the square of a thin layer's transmission would lose its digits.
    both.depth = 2.0 * layer.depth;
    both.beam_depth = 2.0 * layer.beam_depth;
    both.direct = (-both.depth).exp();
    both.beam_direct = (-both.beam_depth).exp();
    both.reflected = r + direct * up + t * up;
    both.scattered = direct * down + t * direct + t * down;
    both.beam_reflected = layer.beam_reflected + beam_direct * beam_up + layer.beam_scattered * up;
    both.beam_scattered = beam_direct * beam_down + layer.beam_scattered * direct + layer.beam_scattered * down;
    return both;
}

Layer layer_of(const Medium& medium, const Angular& a, double albedo)
{
    // Compute the delta-M depth and albedo, without the light that scatters into the peak.
    const double depth = medium.thickness * (1.0 - albedo * a.peak);
    const double scaled_albedo = albedo * (1.0 - a.peak) / (1.0 - albedo * a.peak);
    const double thin = first_layer * std::min(a.cosine.minCoeff(), a.beam_cosine.minCoeff());
    const bool ends = !medium.is_half_space();
    // A half-space ends at `opaque`; 100 doublings exceed the need of any albedo below 1.
    const int doublings = ends ? std::max(0, static_cast<int>(std::ceil(std::log2(depth / thin)))) : 100;
    Layer layer = thin_layer(a, scaled_albedo, ends ? std::ldexp(depth, -doublings) : thin);
    for (int i = 0; i < doublings; ++i) {
        layer = doubled(layer);
        if (!ends &&
            std::max({layer.scattered.maxCoeff(), layer.direct.maxCoeff(), layer.beam_direct.maxCoeff()}) < opaque)
            break;
    }
    return layer;
}

// Radiance outside toward the beams, divided by the incident diffuse radiance, when light arrives on both sides: with
// the same sign (sign = 1) or the opposite sign on the far side (sign = -1). The half sum of both cases is the
// reflectance, the half difference the transmittance.
ArrayXd returned(const Angular& a, const Layer& layer, double sign)
{
    // Radiance grows by ior^2 on the way in and shrinks by it on the way out, hence neither factor appears.
    MatrixXd through = layer.reflected + sign * layer.scattered;
    through.diagonal() += sign * layer.direct.matrix();
    const VectorXd entering = (1.0 - a.reflectance).matrix();
    MatrixXd reflections = -through * a.reflectance.matrix().asDiagonal();
    reflections.diagonal().array() += 1.0;
    const VectorXd up = reflections.partialPivLu().solve(through * entering);
    const VectorXd down = entering + (a.reflectance * up.array()).matrix();
    const ArrayXd direct = sign * layer.beam_direct;
    const ArrayXd beam_up =
        (((layer.beam_reflected + sign * layer.beam_scattered) * down).array() + direct * (1.0 - a.beam_reflectance)) /
        (1.0 - direct * a.beam_reflectance);
    return beam_up * (1.0 - a.beam_reflectance);
}

}  // namespace

double exact_totals_error(const Medium& medium)
{
    return 2e-5 + 0.1 * std::pow(std::abs(medium.g), coefficient_count(medium.g));
}

ExactTotals exact_totals(const Medium& medium, std::span<const double> angles_deg, std::span<const double> albedos,
                         int threads)
{
    validate(medium);
    for (double angle : angles_deg)
        if (!(angle >= 0.0 && angle < 90.0))
            reject("angles", angle, "0 <= angle < 90 degrees");
    for (double albedo : albedos)
        if (!(albedo >= 0.0 && albedo < 1.0))
            reject("albedos", albedo, "0 <= albedo < 1");
    const std::size_t count = angles_deg.size() * albedos.size();
    ExactTotals totals{std::vector<double>(count), std::vector<double>(count)};
    if (count == 0)
        return totals;
    const Angular angular = angular_problem(medium, angles_deg);
    with_threads(threads, [&] {
        parallel_for(albedos.size(), [&](std::size_t k) {
            const Layer layer = layer_of(medium, angular, albedos[k]);
            const ArrayXd same = returned(angular, layer, 1.0);
            const ArrayXd opposite = returned(angular, layer, -1.0);
            for (std::size_t j = 0; j < angles_deg.size(); ++j) {
                const auto beam = static_cast<Eigen::Index>(j);
                const std::size_t index = j * albedos.size() + k;
                totals.reflectance[index] = 0.5 * (same(beam) + opposite(beam));
                totals.transmittance[index] = medium.is_half_space() ? 0.0 : 0.5 * (same(beam) - opposite(beam));
            }
        });
    });
    return totals;
}

}  // namespace beamspread
