#include "solve/textured/smooth_ratio.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "base/threads.h"
#include "solve/textured/ratio_rows.h"

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

// Widths share a block if the least cost is less by up to this fraction of the noise without smoothing, so that last bits
// of the light never change a width. Larger: blocks that are smoothed too little or too much.
constexpr float tie = 0.05f;

// Blocks along a side of the regions whose mean errors are estimated. Larger: less noise of these; smaller: errors of few
// texels next to others count as they are.
constexpr std::size_t region_side = 16;

// Weights of a Gaussian, and the texels that it reaches on either side.
struct Gaussian {
    explicit Gaussian(double sigma) : reach(static_cast<std::size_t>(std::ceil(3.0 * sigma)))
    {
        double sum = 0.0;
        for (std::size_t i = 0; i <= 2 * reach; ++i) {
            const double away = static_cast<double>(i) - static_cast<double>(reach);
            weights.push_back(sigma > 0.0 ? static_cast<float>(std::exp(-0.5 * away * away / (sigma * sigma))) : 1.0f);
            sum += static_cast<double>(weights.back());
        }
        for (float& weight : weights)
            weight /= static_cast<float>(sum);
    }

    std::size_t reach;
    std::vector<float> weights;
};

// Smooths rows of maps. The texels at the border continue beyond it.
class RowSmoother {
public:
    RowSmoother(const Gaussian& gaussian, std::size_t width, std::size_t height)
        : m_gaussian(gaussian),
          m_width(width),
          m_height(height),
          m_padded(width + 2 * gaussian.reach),
          m_rows(gaussian.weights.size())
    {
    }

    // Row y of the smoothed map.
    void operator()(const float* map, std::size_t y, float* smoothed)
    {
        const std::size_t reach = m_gaussian.reach;
        for (std::size_t k = 0; k < m_rows.size(); ++k)
            m_rows[k] = map + (std::clamp(y + k, reach, m_height - 1 + reach) - reach) * m_width;
        float* const middle = m_padded.data() + reach;
        sum_rows(middle, m_rows, m_gaussian.weights, m_width);
        std::fill_n(m_padded.data(), reach, middle[0]);
        std::fill_n(middle + m_width, reach, middle[m_width - 1]);
        for (std::size_t k = 0; k < m_rows.size(); ++k)
            m_rows[k] = m_padded.data() + k;
        sum_rows(smoothed, m_rows, m_gaussian.weights, m_width);
    }

private:
    const Gaussian& m_gaussian;
    std::size_t m_width;
    std::size_t m_height;
    Map m_padded;
    std::vector<const float*> m_rows;
};

Map smoothed(const Map& map, const Gaussian& gaussian, std::size_t width, std::size_t height)
{
    Map result(map.size());
    parallel_for(height, [&](std::size_t y) {
        RowSmoother smooth(gaussian, width, height);
        smooth(map.data(), y, result.data() + y * width);
    });
    return result;
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

// Means over the texels of each block at one width, in units of the squared luminance.
struct Errors {
    explicit Errors(std::size_t blocks) : cost(blocks), variance(blocks), power(blocks) {}

    Map cost;      // error by blur and noise; may be negative by chance
    Map variance;  // error by noise alone
    Map power;     // of the luminance itself
};

// Sums of both halves in a row.
struct SumsRow {
    explicit SumsRow(std::size_t width)
        : textured{Map(width), Map(width), Map(width)}, plain{Map(width), Map(width), Map(width)}, one(width, 1.0f)
    {
    }

    // Writes the ratios of the halves, and that of both. Where no path found light the convention stays: 1.
    void divide(std::array<Map, 2>& halves, float* both)
    {
        const std::size_t width = one.size();
        add_rows(textured[2].data(), textured[0].data(), textured[1].data(), width);
        add_rows(plain[2].data(), plain[0].data(), plain[1].data(), width);
        divide_rows(both, textured[2].data(), plain[2].data(), one.data(), width);
        for (std::size_t h = 0; h < 2; ++h)
            divide_rows(halves[h].data(), textured[h].data(), plain[h].data(), both, width);
    }

    std::array<Map, 3> textured;  // halves, both
    std::array<Map, 3> plain;
    Map one;
};

// Errors at some widths of which the first is 0.
std::vector<Errors> errors_at(const PathSums& sums, std::size_t width, const ScaleRow& scale,
                              std::span<const double> sigmas)
{
    const std::size_t height = sums.plain[0].size() / width;
    const Blocks blocks(width, height);
    const std::vector<Gaussian> gaussians(sigmas.begin(), sigmas.end());
    std::vector<Errors> result(sigmas.size(), Errors(blocks.count()));
    parallel_for(blocks.height, [&](std::size_t block_row) {
        const std::size_t first = block_row * block_side, rows = std::min(block_side, height - first);
        SumsRow row(width);
        const std::array<Map, 2> empty{Map(width), Map(width)};
        std::vector<std::array<Map, 2>> fine(rows, empty);
        std::vector<Map> scales(rows, Map(width));
        for (std::size_t r = 0; r < rows; ++r)
            scale(first + r, scales[r].data());
        std::array<Map, 2> smooth = empty;
        Map both(width);
        for (std::size_t k = 0; k < sigmas.size(); ++k) {
            RowSmoother smoother(gaussians[k], width, height);
            Map cost(width), variance(width), power(width);
            for (std::size_t r = 0; r < rows; ++r) {
                const std::size_t y = first + r;
                for (std::size_t h = 0; h < 2; ++h) {
                    smoother(sums.textured[h].data(), y, row.textured[h].data());
                    smoother(sums.plain[h].data(), y, row.plain[h].data());
                }
                std::array<Map, 2>& now = k == 0 ? fine[r] : smooth;
                row.divide(now, both.data());
                add_errors(cost.data(), variance.data(), {now[0].data(), now[1].data()},
                           {fine[r][0].data(), fine[r][1].data()}, scales[r].data(), width);
                for (std::size_t x = 0; x < width; ++x) {
                    const float luminance = scales[r][x] * both[x];
                    power[x] += luminance * luminance;
                }
            }
            for (std::size_t column = 0; column < blocks.width; ++column) {
                const std::size_t begin = column * block_side, end = std::min(begin + block_side, width);
                const auto texels = static_cast<float>(rows * (end - begin));
                const auto mean = [&](const Map& values) {
                    return std::accumulate(values.data() + begin, values.data() + end, 0.0f) / texels;
                };
                const std::size_t block = block_row * blocks.width + column;
                result[k].cost[block] = mean(cost);
                result[k].variance[block] = mean(variance);
                result[k].power[block] = mean(power);
            }
        }
    });
    const Gaussian around(choice_width);
    for (Errors& errors : result) {
        errors.cost = smoothed(errors.cost, around, blocks.width, blocks.height);
        errors.variance = smoothed(errors.variance, around, blocks.width, blocks.height);
    }
    return result;
}

// Weights of widths in a block whose best one is known.
std::array<float, widths.size()> weights_of(const std::vector<Errors>& errors, std::size_t block, std::size_t best)
{
    std::array<float, widths.size()> weights{};
    const float least = errors[best].cost[block], range = tie * errors[0].variance[block];
    float sum = 0.0f;
    for (std::size_t k = 0; k < widths.size(); ++k) {
        const float more = errors[k].cost[block] - least;
        weights[k] = k == best ? 1.0f : more < range ? 1.0f - more / range : 0.0f;
        sum += weights[k];
    }
    for (float& weight : weights)
        weight /= sum;
    return weights;
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

SmoothingChoice choose_smoothing(const PathSums& sums, std::size_t width, const ScaleRow& scale)
{
    const Blocks blocks(width, sums.plain[0].size() / width);
    const std::vector<Errors> errors = errors_at(sums, width, scale, widths);
    SmoothingChoice result{{widths.size(), Map(blocks.count())}, 0.0};
    const std::size_t regions = (blocks.width + region_side - 1) / region_side;
    std::vector<double> costs((blocks.height + region_side - 1) / region_side * regions), variances(costs.size());
    double power = 0.0;
    for (std::size_t b = 0; b < blocks.count(); ++b) {
        std::size_t best = 0;
        for (std::size_t k = 1; k < widths.size(); ++k)
            if (errors[k].cost[b] < errors[best].cost[b])
                best = k;
        const std::array<float, widths.size()> weights = weights_of(errors, b, best);
        for (std::size_t k = 0; k < widths.size(); ++k)
            result.weights[k][b] = weights[k];
        const std::size_t region = b / blocks.width / region_side * regions + b % blocks.width / region_side;
        costs[region] += static_cast<double>(errors[best].cost[b]);
        variances[region] += static_cast<double>(errors[best].variance[b]);
        power += static_cast<double>(errors[best].power[b]);
    }
    // The noise of the costs would count as an error if the larger one of a block's two did.
    double error = 0.0;
    for (std::size_t r = 0; r < costs.size(); ++r)
        error += std::max(costs[r], variances[r]);
    result.error = power > 0.0 ? std::sqrt(error / power) : 0.0;
    return result;
}

void smooth_ratio(PathSums sums, std::size_t width, const SmoothingChoice& choice,
                  const std::function<void(std::size_t y, const float* ratio)>& take)
{
    const std::size_t height = sums.plain[0].size() / width;
    const Blocks blocks(width, height);
    for (std::array<Map, 2>* halves : {&sums.textured, &sums.plain}) {
        auto& [both, other] = *halves;
        parallel_for(height, [&](std::size_t y) {
            float* const row = both.data() + y * width;
            add_rows(row, row, other.data() + y * width, width);
        });
        Map().swap(other);
    }
    const std::vector<Gaussian> gaussians(widths.begin(), widths.end());
    std::vector<Between> columns;
    for (std::size_t x = 0; x < width; ++x)
        columns.push_back(between_blocks(x, blocks.width));
    parallel_for(blocks.height, [&](std::size_t block_row) {
        Map textured(width), plain(width), ratio(width), sum(width);
        const Map one(width, 1.0f);
        const std::size_t end = std::min((block_row + 1) * block_side, height);
        for (std::size_t y = block_row * block_side; y < end; ++y) {
            const Between up = between_blocks(y, blocks.height);
            std::ranges::fill(sum, 0.0f);
            for (std::size_t k = 0; k < widths.size(); ++k) {
                const std::span<const float> weights(choice.weights[k]);
                const std::span<const float> below = weights.subspan(up.left * blocks.width, blocks.width);
                const std::span<const float> above = weights.subspan(up.right * blocks.width, blocks.width);
                const auto is_used = [](float weight) { return weight > 0.0f; };
                if (std::ranges::none_of(below, is_used) && std::ranges::none_of(above, is_used))
                    continue;
                RowSmoother smoother(gaussians[k], width, height);
                smoother(sums.textured[0].data(), y, textured.data());
                smoother(sums.plain[0].data(), y, plain.data());
                divide_rows(ratio.data(), textured.data(), plain.data(), one.data(), width);
                for (std::size_t x = 0; x < width; ++x) {
                    const Between& across = columns[x];
                    const float weight =
                        std::lerp(std::lerp(below[across.left], below[across.right], across.weight),
                                  std::lerp(above[across.left], above[across.right], across.weight), up.weight);
                    sum[x] += weight * ratio[x];
                }
            }
            take(y, sum.data());
        }
    });
}

double cost_of_smoothing(const PathSums& sums, std::size_t width, const ScaleRow& scale)
{
    const std::array<double, 2> sigmas{0.0, compared_width};
    const Map cost = errors_at(sums, width, scale, sigmas)[1].cost;
    return std::accumulate(cost.begin(), cost.end(), 0.0) / static_cast<double>(cost.size());
}

}  // namespace beamspread
