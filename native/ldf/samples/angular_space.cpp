#include "ldf/samples/ldf_sample.h"

#include <algorithm>
#include <cmath>

#include <glm/mat4x4.hpp>

#include "base/constants.h"
#include "base/error.h"
#include "ldf/samples/interpolate.h"

namespace beamspread {

namespace {

// Largest distance from H, in heights. Farther out psi rounds to pi/2.
constexpr double max_distance = 1e15;

// Root mean square of the noise that smoothing leaves, over the peak. Larger: less smoothing, a noisier point.
constexpr double max_noise = 0.01;

// Value of texels that belong to the top, over the peak. Larger: a smaller top, more noise, less bias.
constexpr double top_fraction = 0.95;

// Texels across the top from which it counts as resolved. Larger: more peaks beside O count as a pencil beam's.
constexpr double min_top_width = 4.0;

struct Parts {
    std::vector<double> even;
    std::vector<double> odd;
};

// Parts of the image that are even and odd in v.
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
    const double max_sigma = static_cast<double>(std::min(sample.width, sample.height)) / 8.0;
    std::vector<double> values = parts.even;
    for (double sigma = 1.0;; sigma *= 2.0) {
        const std::size_t peak = brightest_texel(values);
        const auto reach = static_cast<std::size_t>(std::max(8.0, 2.0 * sigma));
        const std::vector<double> noise =
            sigma > 1.0 ? blur(parts.odd, sample.width, sample.height, 0.5 * sigma) : parts.odd;
        if (rms_around(noise, sample, peak, reach) <= max_noise * values[peak] || sigma > max_sigma)
            return values;
        values = blur(parts.even, sample.width, sample.height, sigma);
    }
}

// Texels of the peak's top: those connected with the brightest one that reach `top_fraction` of it.
std::vector<std::size_t> top_of(const std::vector<double>& values, const LdfSample& sample)
{
    std::vector<std::size_t> top{brightest_texel(values)};
    const double threshold = top_fraction * values[top.front()];
    std::vector<bool> seen(values.size(), false);
    seen[top.front()] = true;
    for (std::size_t k = 0; k < top.size(); ++k) {
        const std::size_t x = top[k] % sample.width;
        const std::size_t y = top[k] / sample.width;
        const auto visit = [&](bool exists, std::size_t texel) {
            if (exists && !seen[texel] && values[texel] >= threshold) {
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

// u of the vertex of value = a + b u + c (u^2 + v^2), fitted by least squares; `middle` if the fit has no maximum.
// Lengths are in texels; the sums are around `middle`, which keeps them well conditioned.
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
    // Compute the normal equations without the constant term.
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

AngularCoordinates AngularSpace::to_angular(const Vec2& point) const
{
    const Vec2 offset = point - m_brightest;
    if (const double distance = std::hypot(offset.x, offset.y); !(distance <= max_distance * m_height))
        reject("u, v", distance, "points within 1e15 heights of the brightest point");
    const double phi = std::atan2(offset.y, offset.x);
    const double positive = phi < 0.0 ? phi + 2.0 * pi : phi;
    // Rounding can turn a negative angle next to 0 into 2 pi.
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
    if (last - first + 1.0 < min_top_width)
        return Vec2(std::abs(middle) <= 1.0 ? 0.0 : middle * sample.pitch, 0.0);
    return Vec2(std::clamp(vertex(values, top, sample, middle), first, last) * sample.pitch, 0.0);
}

}  // namespace beamspread
