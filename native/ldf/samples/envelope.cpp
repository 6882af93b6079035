#include "ldf/samples/interpolate.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

std::vector<double> gaussian(double sigma)
{
    const auto reach = static_cast<std::size_t>(std::ceil(3.0 * sigma));
    std::vector<double> weights(reach + 1);
    for (std::size_t i = 0; i <= reach; ++i)
        weights[i] = std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma));
    return weights;
}

// Blurs `count` values that are `stride` apart. Values outside have no weight.
void blur_line(const double* from, double* to, std::size_t count, std::size_t stride,
               const std::vector<double>& weights)
{
    const std::size_t reach = weights.size() - 1;
    for (std::size_t i = 0; i < count; ++i) {
        double sum = 0.0;
        double total = 0.0;
        for (std::size_t k = i - std::min(i, reach); k <= std::min(count - 1, i + reach); ++k) {
            const double weight = weights[k > i ? k - i : i - k];
            sum += weight * from[k * stride];
            total += weight;
        }
        to[i * stride] = sum / total;
    }
}

// Relative noise that averages may have. The bias of the logarithm is half of its square. Larger: less blur, more bias.
constexpr double max_noise = 0.1;

// Relative noise of the means over rings. Larger: narrower rings, noisier means.
constexpr double max_ring_noise = 0.3;

// Standard deviation, in texels, of the blur that estimates the noise. Larger: a more reliable estimate, more time.
constexpr double noise_sigma = 3.0;

// Relative variance of texels with too little light for an estimate.
constexpr double unknown_variance = 1e6;

// Smallest exitance, which keeps logarithms finite.
constexpr double black = 1e-300;

bool is_clear(double mean, double variance, double allowed = max_noise)
{
    return mean > black && variance <= allowed * allowed * mean * mean;
}

// Estimate of the noise's variance in each texel, from its mirror image in v.
std::vector<double> noise_of(const LdfSample& sample)
{
    std::vector<double> variance(sample.image.size());
    for (std::size_t y = 0; y < sample.height; ++y) {
        for (std::size_t x = 0; x < sample.width; ++x) {
            const double difference =
                static_cast<double>(sample.at(y, x)) - static_cast<double>(sample.at(sample.height - 1 - y, x));
            variance[y * sample.width + x] = 0.5 * difference * difference;
        }
    }
    return variance;
}

struct Ring {
    double count = 0.0;
    double radius = 0.0;  // radius, value and variance: sums over the texels, then means
    double value = 0.0;
    double variance = 0.0;

    void add(const Ring& ring)
    {
        count += ring.count;
        radius += ring.radius;
        value += ring.value;
        variance += ring.variance;
    }
};

Ring mean_of(const Ring& sums)
{
    return {1.0, sums.radius / sums.count, sums.value / sums.count, 0.0};
}

// Rings around O, a texel wide or joined until their noise is small enough; ascending from O.
std::vector<Ring> rings_of(const LdfSample& sample, const std::vector<double>& variance)
{
    std::vector<Ring> narrow(sample.width + sample.height);
    for (std::size_t y = 0; y < sample.height; ++y) {
        for (std::size_t x = 0; x < sample.width; ++x) {
            const double r = std::hypot(sample.u(x), sample.v(y));
            narrow[static_cast<std::size_t>(r / sample.pitch)].add(
                {1.0, r, static_cast<double>(sample.at(y, x)), variance[y * sample.width + x]});
        }
    }
    std::vector<Ring> rings;
    Ring joined;
    for (const Ring& ring : narrow) {
        joined.add(ring);
        if (is_clear(joined.value, joined.variance, max_ring_noise)) {
            rings.push_back(mean_of(joined));
            joined = Ring();
        }
    }
    return rings;
}

// Mean over rings around O, at every texel: exponential between the rings, and beyond the last one, where it declines
// at least as fast as from the first to the last.
std::vector<double> ring_means(const LdfSample& sample, const std::vector<double>& variance)
{
    const std::vector<Ring> rings = rings_of(sample, variance);
    if (rings.size() < 2) {
        const double texels = static_cast<double>(sample.image.size());
        return std::vector<double>(sample.image.size(),
                                   std::max(black, sample.power() / (texels * sample.pitch * sample.pitch)));
    }
    const auto slope = [](const Ring& a, const Ring& b) { return std::log(b.value / a.value) / (b.radius - a.radius); };
    const Ring& last = rings.back();
    const double outer = std::min(0.0, std::min(slope(rings[rings.size() / 2], last), slope(rings.front(), last)));
    std::vector<double> means(sample.image.size());
    for (std::size_t y = 0; y < sample.height; ++y) {
        for (std::size_t x = 0; x < sample.width; ++x) {
            const double r = std::hypot(sample.u(x), sample.v(y));
            const auto above =
                std::find_if(rings.begin(), rings.end(), [r](const Ring& ring) { return ring.radius > r; });
            double logarithm = 0.0;
            if (above == rings.begin())
                logarithm = std::log(rings.front().value);
            else if (above == rings.end())
                logarithm = std::log(last.value) + outer * (r - last.radius);
            else
                logarithm = std::log((above - 1)->value) + slope(*(above - 1), *above) * (r - (above - 1)->radius);
            means[y * sample.width + x] = std::max(black, std::exp(logarithm));
        }
    }
    return means;
}

}  // namespace

std::vector<double> blur(const std::vector<double>& values, std::size_t width, std::size_t height, double sigma)
{
    if (sigma == 0.0)
        return values;
    const std::vector<double> weights = gaussian(sigma);
    std::vector<double> rows(values.size());
    for (std::size_t y = 0; y < height; ++y)
        blur_line(values.data() + y * width, rows.data() + y * width, width, 1, weights);
    std::vector<double> result(values.size());
    for (std::size_t x = 0; x < width; ++x)
        blur_line(rows.data() + x, result.data() + x, height, width, weights);
    return result;
}

Envelope envelope(const LdfSample& sample)
{
    const std::vector<double> image(sample.image.begin(), sample.image.end());
    Envelope result{image, std::vector<double>(image.size(), unknown_variance)};
    const std::vector<double> variance = noise_of(sample);
    std::vector<double> noise = blur(variance, sample.width, sample.height, noise_sigma);
    std::vector<std::size_t> open;  // texels that are not clear yet
    for (std::size_t i = 0; i < image.size(); ++i) {
        if (is_clear(image[i], noise[i]))
            result.variance[i] = noise[i] / (image[i] * image[i]);
        else
            open.push_back(i);
    }
    if (open.empty())
        return result;

    const std::vector<double> means = ring_means(sample, variance);
    const double max_sigma = static_cast<double>(std::min(sample.width, sample.height)) / 8.0;
    double sigma = 1.0;
    while (sigma <= max_sigma && !open.empty()) {
        const std::vector<double> blurred = blur(image, sample.width, sample.height, sigma);
        const std::vector<double> blurred_means = blur(means, sample.width, sample.height, sigma);
        noise = blur(variance, sample.width, sample.height, std::max(noise_sigma, sigma));
        const double texels = 4.0 * pi * sigma * sigma;  // effective number in an average
        std::erase_if(open, [&](std::size_t i) {
            const bool clear = is_clear(blurred[i], noise[i] / texels);
            if (clear) {
                result.value[i] = std::max(black, means[i] * blurred[i] / blurred_means[i]);
                result.variance[i] = noise[i] / (blurred[i] * blurred[i]);
            }
            return clear;
        });
        sigma *= 2.0;
    }
    for (const std::size_t i : open)
        result.value[i] = means[i];
    return result;
}

}  // namespace beamspread
