#include "ldf/samples/blur.h"

#include <algorithm>
#include <cmath>

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

// Along `count` values, `stride` apart; what lies outside has no weight.
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

}  // namespace beamspread
