#include "solve/textured/smooth_ratio.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

using Map = std::vector<float>;

// Standard deviations of the Gaussians that a ratio may be smoothed by, texels.
constexpr std::array<double, 4> widths{0.0, 1.0, 2.0, 4.0};

// Standard deviation of the Gaussian that averages errors before a width is chosen, and of the one that blends widths.
// Larger: fewer wrong choices, and widths that follow the map less closely.
constexpr double choice_width = 8.0;
constexpr double blend_width = 2.0;

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

// Ratios of the halves and of both together, at one width. Where no path found light the convention stays: 1.
struct Ratios {
    std::array<Map, 2> half;
    Map both;
};

Ratios ratios_of(const PathSums& sums)
{
    const std::size_t count = sums.plain[0].size();
    Ratios ratios{{Map(count), Map(count)}, Map(count)};
    for (std::size_t i = 0; i < count; ++i) {
        const float textured = sums.textured[0][i] + sums.textured[1][i], plain = sums.plain[0][i] + sums.plain[1][i];
        ratios.both[i] = plain > 0.0f ? textured / plain : 1.0f;
        for (std::size_t h = 0; h < 2; ++h)
            ratios.half[h][i] = sums.plain[h][i] > 0.0f ? sums.textured[h][i] / sums.plain[h][i] : ratios.both[i];
    }
    return ratios;
}

double square(double value)
{
    return value * value;
}

}  // namespace

double smooth_ratio(const PathSums& sums, const std::vector<float>& scale, std::size_t width, std::size_t height,
                    std::vector<float>& ratio)
{
    const std::size_t count = width * height;
    const Gaussian around(choice_width, width, height), blend(blend_width, width, height);
    std::vector<Ratios> all;
    std::vector<Map> costs, variances;
    for (const double sigma : widths) {
        PathSums smoothed = sums;
        if (sigma > 0.0) {
            const Gaussian gaussian(sigma, width, height);
            for (std::size_t h = 0; h < 2; ++h) {
                smoothed.textured[h] = gaussian(sums.textured[h]);
                smoothed.plain[h] = gaussian(sums.plain[h]);
            }
        }
        all.push_back(ratios_of(smoothed));
        const Ratios& fine = all.front();
        const Ratios& now = all.back();
        // The squared blur, and the variance of the mean of both halves (Rousselle, Manzi, Zwicker 2013): half of one half's,
        // 1/2 (r0 - r1)^2, is left, and a half differs from the other finest one by the blur and the variance of both.
        Map cost(count), left(count);
        for (std::size_t i = 0; i < count; ++i) {
            const auto s = static_cast<double>(scale[i]);
            const double crossed =
                0.5 * (square(s * (now.half[0][i] - fine.half[1][i])) + square(s * (now.half[1][i] - fine.half[0][i])));
            const double variance = 0.5 * square(s * (now.half[0][i] - now.half[1][i]));
            const double finest_variance = 0.5 * square(s * (fine.half[0][i] - fine.half[1][i]));
            cost[i] = static_cast<float>(crossed - finest_variance - 0.5 * variance);
            left[i] = static_cast<float>(0.5 * variance);
        }
        costs.push_back(around(cost));
        variances.push_back(around(left));
    }
    std::vector<Map> chosen(widths.size(), Map(count));
    double error = 0.0, mean = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        std::size_t best = 0;
        for (std::size_t k = 1; k < widths.size(); ++k)
            if (costs[k][i] < costs[best][i])
                best = k;
        chosen[best][i] = 1.0f;
        error += static_cast<double>(std::max(costs[best][i], variances[best][i]));
    }
    ratio.assign(count, 0.0f);
    for (std::size_t k = 0; k < widths.size(); ++k) {
        const Map part = blend(chosen[k]);
        add_scaled_product(ratio.data(), part.data(), all[k].both.data(), 1.0f, count);
    }
    for (std::size_t i = 0; i < count; ++i)
        mean += static_cast<double>(scale[i]) * ratio[i];
    return mean > 0.0 ? std::sqrt(error / static_cast<double>(count)) / (mean / static_cast<double>(count)) : 0.0;
}

}  // namespace beamspread
