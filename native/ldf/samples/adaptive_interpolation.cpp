// The adaptive method: geometric means in angular space, with weights and heights of Q from the distributions.
//
// 1. Logarithms. LDFs fall off exponentially and with powers of the albedo, hence their logarithms change evenly
//    between samples. For noisy images the logarithm is that of their envelope S; the result is
//        S* sum of w_k image_k / S_k,   log S* = sum of W_k log S_k,
//    with linear weights w_k that are reduced for noisy images. This keeps dark texels, noise, and the mean over noise.
// 2. Angle. A beam from the other side gives the mirrored LDF: log g is the sum of a part that is even in u and in the
//    angle, and one that is odd in both. In s = tan(theta / 2), the polynomials through the samples and their mirror
//    images are linear in s^2 for the even part, and s times linear in s^2 for the odd part. The variable s is natural:
//    reflection is proportional to 1 / (mu + mu') in the cosines of incidence and exit (Chandrasekhar 1960, Ch. III),
//    toward the normal 1 / (1 + mu) = (1 + s^2) / 2.
// 3. Albedo. Every path scatters at least once, hence log(g / albedo). For a pencil beam it is linear in the diffusion
//    exponent kappa = sqrt(3 (1 - albedo) (1 - g albedo)): exactly far out, and near O it hardly changes. Deep inside a
//    wide beam exitance is proportional to the reflectance R, and log(g / albedo) is linear in log(R / albedo) by van
//    de Hulst's approximation. Near the beam's border the weights change from one to the other within
//    `interior_depth`. Q's height plays no part: the albedo changes an exponent and not a unit of length.
// 4. Anisotropy. Far out, lengths scale with the transport mean free path (similarity: Wyman, Patterson, Wilson 1989,
//    doi:10.1364/AO.28.005243). The height of Q above O is therefore the root mean square radius of each sample, and
//    their geometric mean for the result; g height^2 is blended, which keeps the power. log g is linear in log(1 - g).
//    Along the other axes all samples have one height, which cancels.
#include "ldf/samples/interpolate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/constants.h"
#include "ldf/samples/ldf_sample.h"

namespace beamspread {

namespace {

// Anisotropy of samples without g: a common value of translucent materials.
constexpr double default_g = 0.8;

double half_angle_tangent(double angle_deg)
{
    return std::tan(0.5 * angle_deg * radians_per_degree);
}

double diffusion_exponent(double albedo, double g)
{
    return std::sqrt(3.0 * (1.0 - albedo) * (1.0 - g * albedo));
}

// Weight of the upper end of a bracket, linear in f(x).
template <class Function>
double weight_between(const Bracket& axis, double x, const Function& f)
{
    return axis.lower == axis.upper ? 0.0 : (f(x) - f(axis.lower)) / (f(axis.upper) - f(axis.lower));
}

// Logarithm of a half-space's reflectance over the albedo: spherical albedo (van de Hulst 1980, Sec. 11.1.3).
double log_reflectance_per_scattering(double albedo, double g)
{
    const double s = std::sqrt((1.0 - albedo) / (1.0 - g * albedo));
    return std::log((1.0 - s) * (1.0 - 0.139 * s) / ((1.0 + 1.17 * s) * albedo));
}

// Distance in mean free paths from the beam's border at which its interior counts as wide. Larger: a wider transition.
constexpr double interior_depth = 6.0;

// Relative variance of noise below which all samples count alike: that of `max_noise` in envelope.cpp. Larger: noisy
// samples count more.
constexpr double tolerated_variance = 0.01;

// Fraction of a beam of this radius in an exponential neighbourhood of a point at distance r from O: 0 far from any
// light, 1 deep inside.
double interior(double r, double radius)
{
    constexpr int directions = 64;  // more: smaller errors, more time
    double sum = 0.0;
    for (int i = 0; i < directions; ++i) {
        const double phi = (i + 0.5) * pi / directions;  // from the direction away from O
        const double miss = r * std::sin(phi);
        if (miss >= radius)
            continue;
        const double half_chord = std::sqrt(radius * radius - miss * miss);
        const double to_middle = -r * std::cos(phi);
        const double from = std::max(0.0, to_middle - half_chord);
        const double to = std::max(0.0, to_middle + half_chord);
        sum += std::exp(-from / interior_depth) - std::exp(-to / interior_depth);
    }
    return sum / directions;
}

// Weight of the samples of the upper albedo, for each texel.
std::vector<double> albedo_weights(const Bracket& axis, double albedo, double g, const LdfSample& like)
{
    // A black sample has no shape: take g / albedo of the other one.
    if (axis.lower == 0.0 && axis.upper > 0.0)
        return std::vector<double>(like.image.size(), 1.0);
    const double outside = weight_between(axis, albedo, [g](double a) { return diffusion_exponent(a, g); });
    const double inside = weight_between(axis, albedo, [g](double a) { return log_reflectance_per_scattering(a, g); });
    std::vector<double> weights;
    weights.reserve(like.image.size());
    for (std::size_t y = 0; y < like.height; ++y)
        for (std::size_t x = 0; x < like.width; ++x) {
            const double c = interior(std::hypot(like.u(x), like.v(y)), 0.5 * like.beam_diameter);
            weights.push_back((1.0 - c) * outside + c * inside);
        }
    return weights;
}

// Weights of the samples at the lower and upper angle, in the parts even and odd in u.
struct ParityWeights {
    std::array<double, 2> even;
    std::array<double, 2> odd;
};

ParityWeights angle_weights(const Bracket& axis, double angle_deg)
{
    const double s = half_angle_tangent(angle_deg);
    const double w =
        weight_between(axis, angle_deg, [](double angle) { return std::pow(half_angle_tangent(angle), 2); });
    const double lower = half_angle_tangent(axis.lower);
    const double upper = half_angle_tangent(axis.upper);
    if (upper == 0.0)
        return {{1.0, 0.0}, {0.0, 0.0}};
    // At normal incidence the odd part is noise: take odd / s of the upper sample.
    if (lower == 0.0)
        return {{1.0 - w, w}, {0.0, s / upper}};
    return {{1.0 - w, w}, {(1.0 - w) * s / lower, w * s / upper}};
}

double rms_radius(const LdfSample& sample)
{
    double power = 0.0;
    double moment = 0.0;
    for (std::size_t y = 0; y < sample.height; ++y) {
        for (std::size_t x = 0; x < sample.width; ++x) {
            const double value = std::max(0.0, static_cast<double>(sample.at(y, x)));
            power += value;
            moment += value * (sample.u(x) * sample.u(x) + sample.v(y) * sample.v(y));
        }
    }
    return power > 0.0 ? std::sqrt(moment / power) : sample.pitch;
}

// The sample scaled from height `from_height` of Q to `to_height`: g height^2 stays the same in each direction.
LdfSample at_height(const LdfSample& sample, double from_height, double to_height)
{
    LdfSample result = sample;
    if (from_height == to_height)
        return result;
    const Vec2 origin(0.0, 0.0);
    const AngularSpace from(origin, origin, from_height);
    const AngularSpace to(origin, origin, to_height);
    const double scale = (from_height / to_height) * (from_height / to_height);
    for (std::size_t y = 0; y < result.height; ++y)
        for (std::size_t x = 0; x < result.width; ++x)
            result.image[y * result.width + x] = static_cast<float>(
                scale * exitance_at(sample, from.to_planar(to.to_angular(Vec2(result.u(x), result.v(y))))));
    return result;
}

// Sums over the samples k at each texel.
struct Blend {
    // Allowed extrapolation of log S* beyond the samples' range. Larger: noise far from light may be amplified.
    static constexpr double slack = 1.0;

    std::vector<double> logarithm;  // log S*
    std::vector<double> ratio;  // sum of w_k image_k / S_k
    std::vector<double> weight;  // sum of w_k
    std::vector<double> lowest;  // range of log S_k here and at the mirrored texel
    std::vector<double> highest;

    explicit Blend(std::size_t texels)
        : logarithm(texels, 0.0),
          ratio(texels, 0.0),
          weight(texels, 0.0),
          lowest(texels, std::numeric_limits<double>::infinity()),
          highest(texels, -std::numeric_limits<double>::infinity())
    {
    }

    double mean(std::size_t texel) const
    {
        // Clamp the extrapolation of the odd part, which would amplify its noise.
        return std::exp(std::clamp(logarithm[texel], lowest[texel] - slack, highest[texel] + slack)) * ratio[texel] /
               weight[texel];
    }

    // Adds a sample with w_k = `linear` and W_k = `even` and `odd`, for the parts even and odd in u, times the texel's
    // weight of the sample's albedo.
    void add(const LdfSample& sample, double linear, double even, double odd, const std::vector<double>& by_albedo,
             bool upper_albedo)
    {
        const auto [smooth, variance] = envelope(sample);
        const double scale = sample.albedo > 0.0 ? sample.albedo : 1.0;
        for (std::size_t y = 0; y < sample.height; ++y) {
            const std::size_t row = y * sample.width;
            for (std::size_t x = 0; x < sample.width; ++x) {
                const double albedo_weight = upper_albedo ? by_albedo[row + x] : 1.0 - by_albedo[row + x];
                if (albedo_weight != 0.0) {
                    const double here = std::log(smooth[row + x] / scale);
                    const double mirrored = std::log(smooth[row + sample.width - 1 - x] / scale);
                    logarithm[row + x] += 0.5 * albedo_weight * (even * (here + mirrored) + odd * (here - mirrored));
                    lowest[row + x] = std::min({lowest[row + x], here, mirrored});
                    highest[row + x] = std::max({highest[row + x], here, mirrored});
                }
                // Clamp undershoots, which may be large beside the envelope.
                const double exitance = std::max(0.0, static_cast<double>(sample.image[row + x]));
                const double w = linear / (tolerated_variance + variance[row + x]);
                ratio[row + x] += w * exitance / smooth[row + x];
                weight[row + x] += w;
            }
        }
    }
};

}  // namespace

std::vector<float> adaptive_image(const SampleCell& cell, double angle_deg, double albedo, std::optional<double> g)
{
    const LdfSample& first = *cell.corners[0][0][0];
    const double medium_g = g.value_or(first.g.value_or(default_g));
    const ParityWeights by_angle = angle_weights(cell.angle, angle_deg);
    const std::vector<double> by_albedo = albedo_weights(cell.albedo, albedo, medium_g, first);
    const double by_g = weight_between(cell.g, medium_g, [](double x) { return std::log(1.0 - x); });
    const std::array<double, 2> g_weights{1.0 - by_g, by_g};

    Blend blend(first.image.size());
    for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t j = 0; j < 2; ++j) {
            const std::array<const LdfSample*, 2>& pair = cell.corners[i][j];
            std::array<double, 2> heights{1.0, 1.0};
            if (pair[0] != pair[1])
                heights = {rms_radius(*pair[0]), rms_radius(*pair[1])};
            const double height = std::pow(heights[0], g_weights[0]) * std::pow(heights[1], g_weights[1]);
            for (std::size_t k = 0; k < 2; ++k) {
                const double even = by_angle.even[i] * g_weights[k];
                const double odd = by_angle.odd[i] * g_weights[k];
                const double weight = cell.angle.weight_of(i) * cell.albedo.weight_of(j) * cell.g.weight_of(k);
                if (weight > 0.0)
                    blend.add(at_height(*pair[k], heights[k], height), weight, even, odd, by_albedo, j == 1);
            }
        }
    }
    std::vector<float> image(first.image.size());
    const double scale = albedo > 0.0 ? albedo : 1.0;
    for (std::size_t i = 0; i < image.size(); ++i)
        image[i] = static_cast<float>(scale * blend.mean(i));
    return image;
}

}  // namespace beamspread
