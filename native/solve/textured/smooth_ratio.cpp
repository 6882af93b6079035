#include "solve/textured/smooth_ratio.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

using Map = std::vector<float>;

// Standard deviations of the Gaussians that a ratio may be smoothed by, texels.
constexpr std::array<double, 4> widths{0.0, 1.0, 2.0, 4.0};

// The one by which factors are compared.
constexpr double compared_width = 2.0;

// Texels along a side of the blocks that each choose a width. Larger: fewer wrong choices, and widths that follow the map
// less closely.
constexpr std::size_t block_side = 4;

// Standard deviation of the Gaussian that averages the errors of blocks before they choose, blocks. As above.
constexpr double choice_width = 2.0;

class Gaussian {
public:
    Gaussian(double sigma, std::size_t width, std::size_t height) : m_width(width), m_height(height)
    {
        const auto reach = static_cast<std::size_t>(std::ceil(3.0 * sigma));
        double sum = 0.0;
        for (std::size_t i = 0; i <= reach; ++i)
            m_weights.push_back(static_cast<float>(std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma))));
        for (std::size_t i = 0; i <= reach; ++i)
            sum += (i == 0 ? 1.0 : 2.0) * static_cast<double>(m_weights[i]);
        for (float& weight : m_weights)
            weight /= static_cast<float>(sum);
    }

    // The texels at the border continue beyond it.
    Map operator()(const Map& values) const
    {
        Map across(values.size()), both(values.size());
        const auto reach = static_cast<std::ptrdiff_t>(m_weights.size()) - 1;
        parallel_for(m_height, [&](std::size_t y) {
            const auto width = static_cast<std::ptrdiff_t>(m_width);
            Map padded(m_width + 2 * static_cast<std::size_t>(reach));
            for (std::ptrdiff_t x = -reach; x < width + reach; ++x)
                padded[static_cast<std::size_t>(x + reach)] =
                    values[y * m_width + static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(x, 0, width - 1))];
            for (std::ptrdiff_t i = -reach; i <= reach; ++i)
                add_scaled(across.data() + y * m_width, padded.data() + i + reach,
                           m_weights[static_cast<std::size_t>(std::abs(i))], m_width);
        });
        parallel_for(m_height, [&](std::size_t y) {
            for (std::ptrdiff_t i = -reach; i <= reach; ++i) {
                const auto row = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(y) + i, 0,
                                                            static_cast<std::ptrdiff_t>(m_height) - 1);
                add_scaled(both.data() + y * m_width, across.data() + static_cast<std::size_t>(row) * m_width,
                           m_weights[static_cast<std::size_t>(std::abs(i))], m_width);
            }
        });
        return both;
    }

private:
    std::size_t m_width;
    std::size_t m_height;
    std::vector<float> m_weights;
};

float ratio_or(float textured, float plain, float otherwise)
{
    return plain > 0.0f ? textured / plain : otherwise;
}

// Ratios of the halves and of both together, at one width. Where no path found light the convention stays: 1.
struct Ratios {
    explicit Ratios(std::size_t count) : half{Map(count), Map(count)}, both(count) {}

    std::array<Map, 2> half;
    Map both;
};

Ratios ratios_of(const PathSums& sums, double sigma, std::size_t width, std::size_t height)
{
    PathSums smoothed;
    if (sigma > 0.0) {
        const Gaussian gaussian(sigma, width, height);
        for (std::size_t h = 0; h < 2; ++h) {
            smoothed.textured[h] = gaussian(sums.textured[h]);
            smoothed.plain[h] = gaussian(sums.plain[h]);
        }
    }
    const PathSums& now = sigma > 0.0 ? smoothed : sums;
    Ratios ratios(width * height);
    parallel_for(height, [&](std::size_t y) {
        for (std::size_t i = y * width; i < (y + 1) * width; ++i) {
            ratios.both[i] = ratio_or(now.textured[0][i] + now.textured[1][i], now.plain[0][i] + now.plain[1][i], 1.0f);
            for (std::size_t h = 0; h < 2; ++h)
                ratios.half[h][i] = ratio_or(now.textured[h][i], now.plain[h][i], ratios.both[i]);
        }
    });
    return ratios;
}

double square(double value)
{
    return value * value;
}

// Blocks of a map, the last ones of a row or column with fewer texels.
struct Blocks {
    Blocks(std::size_t map_width, std::size_t map_height)
        : width((map_width + block_side - 1) / block_side), height((map_height + block_side - 1) / block_side)
    {
    }

    std::size_t count() const { return width * height; }

    std::size_t width;
    std::size_t height;
};

// Mean squared errors of the texels of each block at one width, in units of the luminance.
struct Errors {
    Map cost;      // blur and noise; may be negative by chance
    Map variance;  // noise alone
};

Errors errors_of(const Ratios& now, const std::array<Map, 2>& fine, const std::vector<float>& scale, std::size_t width,
                 std::size_t height)
{
    const Blocks blocks(width, height);
    Errors errors{Map(blocks.count()), Map(blocks.count())};
    parallel_for(blocks.height, [&](std::size_t row) {
        for (std::size_t column = 0; column < blocks.width; ++column) {
            double cost = 0.0, variance = 0.0;
            const std::size_t y_end = std::min((row + 1) * block_side, height);
            const std::size_t x_begin = column * block_side, x_end = std::min(x_begin + block_side, width);
            for (std::size_t y = row * block_side; y < y_end; ++y) {
                for (std::size_t i = y * width + x_begin; i < y * width + x_end; ++i) {
                    // The squared blur, and the variance of the mean of both halves (Rousselle, Manzi, Zwicker 2013): half of
                    // one half's, 1/2 (r0 - r1)^2, is left, and a half differs from the other finest one by the blur and
                    // the variance of both.
                    const auto s = static_cast<double>(scale[i]);
                    const double crossed =
                        0.5 * (square(s * (now.half[0][i] - fine[1][i])) + square(s * (now.half[1][i] - fine[0][i])));
                    const double left = 0.5 * square(s * (now.half[0][i] - now.half[1][i]));
                    const double finest = 0.5 * square(s * (fine[0][i] - fine[1][i]));
                    cost += crossed - finest - 0.5 * left;
                    variance += 0.5 * left;
                }
            }
            const double texels = static_cast<double>((y_end - row * block_side) * (x_end - x_begin));
            errors.cost[row * blocks.width + column] = static_cast<float>(cost / texels);
            errors.variance[row * blocks.width + column] = static_cast<float>(variance / texels);
        }
    });
    const Gaussian around(choice_width, blocks.width, blocks.height);
    return {around(errors.cost), around(errors.variance)};
}

// Weight of the right one of two neighbors at a texel, and the left one, along one axis.
struct Between {
    std::size_t left;
    std::size_t right;
    float weight;
};

Between between_blocks(std::size_t texel, std::size_t blocks)
{
    const double place = (static_cast<double>(texel) + 0.5) / block_side - 0.5;
    const double inside = std::clamp(place, 0.0, static_cast<double>(blocks - 1));
    const auto left = static_cast<std::size_t>(inside);
    return {left, std::min(left + 1, blocks - 1), static_cast<float>(inside - static_cast<double>(left))};
}

}  // namespace

double smooth_ratio(const PathSums& sums, const std::vector<float>& scale, std::size_t width, std::size_t height,
                    std::vector<float>& ratio)
{
    const Blocks blocks(width, height);
    std::array<Map, widths.size()> ratios;
    std::array<Errors, widths.size()> errors;
    std::array<Map, 2> fine;
    for (std::size_t k = 0; k < widths.size(); ++k) {
        Ratios now = ratios_of(sums, widths[k], width, height);
        errors[k] = errors_of(now, k == 0 ? now.half : fine, scale, width, height);
        ratios[k] = std::move(now.both);
        if (k == 0)
            fine = std::move(now.half);
    }
    std::vector<std::uint8_t> choice(blocks.count());
    double error = 0.0;
    for (std::size_t b = 0; b < blocks.count(); ++b) {
        std::uint8_t best = 0;
        for (std::uint8_t k = 1; k < widths.size(); ++k)
            if (errors[k].cost[b] < errors[best].cost[b])
                best = k;
        choice[b] = best;
        error += static_cast<double>(std::max(errors[best].cost[b], errors[best].variance[b]));
    }
    ratio.resize(width * height);
    std::vector<double> row_sums(height);
    parallel_for(height, [&](std::size_t y) {
        const Between up = between_blocks(y, blocks.height);
        for (std::size_t x = 0; x < width; ++x) {
            const Between across = between_blocks(x, blocks.width);
            const std::size_t i = y * width + x;
            const auto at = [&](std::size_t row, std::size_t column) {
                return ratios[choice[row * blocks.width + column]][i];
            };
            const float below = std::lerp(at(up.left, across.left), at(up.left, across.right), across.weight);
            const float above = std::lerp(at(up.right, across.left), at(up.right, across.right), across.weight);
            ratio[i] = std::lerp(below, above, up.weight);
            row_sums[y] += static_cast<double>(scale[i]) * ratio[i];
        }
    });
    const double mean = std::accumulate(row_sums.begin(), row_sums.end(), 0.0) / static_cast<double>(width * height);
    return mean > 0.0 ? std::sqrt(error / static_cast<double>(blocks.count())) / mean : 0.0;
}

double cost_of_smoothing(const PathSums& sums, const std::vector<float>& scale, std::size_t width, std::size_t height)
{
    const Ratios fine = ratios_of(sums, 0.0, width, height);
    const Errors errors = errors_of(ratios_of(sums, compared_width, width, height), fine.half, scale, width, height);
    return std::accumulate(errors.cost.begin(), errors.cost.end(), 0.0) / static_cast<double>(errors.cost.size());
}

}  // namespace beamspread
