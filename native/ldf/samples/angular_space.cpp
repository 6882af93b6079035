#include "ldf/samples/angular_space.h"

#include <algorithm>
#include <cmath>

#include <glm/mat4x4.hpp>

#include "base/constants.h"
#include "base/error.h"
#include "ldf/samples/envelope.h"

namespace beamspread {

namespace {

// In heights. Farther out psi is pi/2 in double precision, which is no place any more.
constexpr double farthest = 1e15;

// Measured on 36 disks of .5 to 15 mean free paths at 30 to 60 degrees, 96 x 96 texels with the noise of 1e4, 1e5 and 1e6
// photons per square mean free path: the point is off by .33, .08 and .11 diameters (root mean square).
//
// Of the peak: a fifth of what its top spans. Half: .34, .16, .11; twice: .20, .11, .07.
constexpr double allowed_noise = 0.01;
// .9: .34, .07, .06; .975: .32, .10, .07
constexpr double top_fraction = 0.95;
// Texels across the top. Half: .32, .08, .08; twice: .34, .08, .11.
constexpr double resolved = 4.0;

struct Parts {
    std::vector<double> even;
    std::vector<double> odd;
};

// Even and odd in v.
Parts split(const LdfSample& sample)
{
    Parts parts{std::vector<double>(sample.image.size()), std::vector<double>(sample.image.size())};
    for (std::size_t y = 0; y < sample.height; ++y) {
        for (std::size_t x = 0; x < sample.width; ++x) {
            const auto here = static_cast<double>(sample.at(y, x));
            const auto mirrored = static_cast<double>(sample.at(sample.height - 1 - y, x));
            parts.even[y * sample.width + x] = 0.5 * (here + mirrored);
            parts.odd[y * sample.width + x] = 0.5 * (here - mirrored);
        }
    }
    return parts;
}

// Root mean square of the values around a texel.
double rms_around(const std::vector<double>& values, const LdfSample& sample, std::size_t texel, std::size_t reach)
{
    const std::size_t x = texel % sample.width;
    const std::size_t y = texel / sample.width;
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t j = y - std::min(y, reach); j <= std::min(sample.height - 1, y + reach); ++j) {
        for (std::size_t i = x - std::min(x, reach); i <= std::min(sample.width - 1, x + reach); ++i) {
            sum += values[j * sample.width + i] * values[j * sample.width + i];
            count += 1.0;
        }
    }
    return std::sqrt(sum / count);
}

std::size_t brightest_texel(const std::vector<double>& values)
{
    return static_cast<std::size_t>(std::distance(values.begin(), std::max_element(values.begin(), values.end())));
}

std::vector<double> denoised(const LdfSample& sample)
{
    const Parts parts = split(sample);
    const double coarsest = static_cast<double>(std::min(sample.width, sample.height)) / 8.0;
    std::vector<double> values = parts.even;
    for (double sigma = 1.0;; sigma *= 2.0) {
        const std::size_t peak = brightest_texel(values);
        const auto reach = static_cast<std::size_t>(std::max(8.0, 2.0 * sigma));
        const std::vector<double> noise =
            sigma > 1.0 ? blur(parts.odd, sample.width, sample.height, 0.5 * sigma) : parts.odd;
        if (rms_around(noise, sample, peak, reach) <= allowed_noise * values[peak] || sigma > coarsest)
            return values;
        values = blur(parts.even, sample.width, sample.height, sigma);
    }
}

// Texels connected with the brightest one that are nearly as bright.
std::vector<std::size_t> top_of(const std::vector<double>& values, const LdfSample& sample)
{
    std::vector<std::size_t> top{brightest_texel(values)};
    const double least = top_fraction * values[top.front()];
    std::vector<bool> seen(values.size(), false);
    seen[top.front()] = true;
    for (std::size_t k = 0; k < top.size(); ++k) {
        const std::size_t x = top[k] % sample.width;
        const std::size_t y = top[k] / sample.width;
        const auto visit = [&](bool exists, std::size_t texel) {
            if (exists && !seen[texel] && values[texel] >= least) {
                seen[texel] = true;
                top.push_back(texel);
            }
        };
        visit(x > 0, top[k] - 1);
        visit(x + 1 < sample.width, top[k] + 1);
        visit(y > 0, top[k] - sample.width);
        visit(y + 1 < sample.height, top[k] + sample.width);
    }
    return top;
}

// Least squares for value = a + b u + c (u^2 + v^2): u of the vertex, or the middle of the top where that isn't convex.
// Lengths in texels from `middle`, which keeps the sums well conditioned.
double vertex(const std::vector<double>& values, const std::vector<std::size_t>& top, const LdfSample& sample,
              double middle)
{
    glm::dmat4 sums(0.0);  // of products of 1, u, q = u^2 + v^2 and the value
    for (const std::size_t texel : top) {
        const double u = sample.u(texel % sample.width) / sample.pitch - middle;
        const double v = sample.v(texel / sample.width) / sample.pitch;
        const glm::dvec4 terms(1.0, u, u * u + v * v, values[texel]);
        sums += glm::outerProduct(terms, terms);
    }
    // The normal equations without their constant term.
    const auto moment = [&](int i, int j) { return sums[i][j] - sums[0][i] * sums[0][j] / sums[0][0]; };
    const double uu = moment(1, 1);
    const double uq = moment(1, 2);
    const double qq = moment(2, 2);
    const double uf = moment(1, 3);
    const double qf = moment(2, 3);
    const double determinant = uu * qq - uq * uq;
    if (!(determinant > 1e-12 * uu * qq))
        return middle;
    const double slope = (uf * qq - qf * uq) / determinant;
    const double curvature = (qf * uu - uf * uq) / determinant;
    return curvature < 0.0 ? middle - 0.5 * slope / curvature : middle;
}

}  // namespace

AngularSpace::AngularSpace(const Vec2& origin, const Vec2& brightest, double height)
    : m_origin(origin), m_brightest(brightest), m_height(height)
{
    for (const double x : {origin.x, origin.y})
        if (!std::isfinite(x))
            reject("origin", x, "two finite numbers");
    for (const double x : {brightest.x, brightest.y})
        if (!std::isfinite(x))
            reject("brightest", x, "two finite numbers");
    if (!(height > 0.0 && std::isfinite(height)))
        reject("height", height, "height > 0");
}

AngularCoordinates AngularSpace::to_angular(const Vec2& place) const
{
    const Vec2 offset = place - m_brightest;
    if (const double distance = std::hypot(offset.x, offset.y); !(distance <= farthest * m_height))
        reject("u, v", distance, "places within 1e15 heights of the brightest point");
    const double phi = std::atan2(offset.y, offset.x);
    const double positive = phi < 0.0 ? phi + 2.0 * pi : phi;
    // A negative angle next to 0 is rounded to 2 pi.
    return {positive < 2.0 * pi ? positive : 0.0, std::atan2(std::hypot(offset.x, offset.y), m_height)};
}

Vec2 AngularSpace::to_planar(const AngularCoordinates& at) const
{
    if (!(at.psi >= 0.0 && at.psi < 0.5 * pi))
        reject("psi", at.psi, "0 <= psi < pi/2");
    if (!std::isfinite(at.phi))
        reject("phi", at.phi, "finite");
    const double r = m_height * std::tan(at.psi);
    return m_brightest + r * Vec2(std::cos(at.phi), std::sin(at.phi));
}

Vec2 brightest_point(const LdfSample& sample)
{
    const std::vector<double> values = denoised(sample);
    const std::vector<std::size_t> top = top_of(values, sample);
    if (!(values[top.front()] > 0.0))
        return Vec2(0.0, 0.0);  // black
    double first = sample.u(top.front() % sample.width) / sample.pitch;
    double last = first;
    for (const std::size_t texel : top) {
        const double u = sample.u(texel % sample.width) / sample.pitch;
        first = std::min(first, u);
        last = std::max(last, u);
    }
    const double middle = 0.5 * (first + last);
    if (last - first + 1.0 < resolved)
        return Vec2(std::abs(middle) <= 1.0 ? 0.0 : middle * sample.pitch, 0.0);
    return Vec2(std::clamp(vertex(values, top, sample, middle), first, last) * sample.pitch, 0.0);
}

}  // namespace beamspread
