#include "bake/node_spline.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simd/loops.h"

namespace beamspread {

namespace {

// Nodes beyond each border, which the four coefficients of a texel reach.
constexpr std::size_t beyond = 2;

// Fills in the coefficients beyond the ends of a line of `nodes` values, `stride` apart.
void extend(float* line, std::size_t stride, std::size_t nodes)
{
    const auto fill = [&](std::size_t end, std::size_t inner, bool is_first) {
        const float rise = line[end * stride] - line[inner * stride];
        for (std::size_t i = 1; i <= beyond; ++i)
            line[(is_first ? end - i : end + i) * stride] = line[end * stride] + static_cast<float>(i) * rise;
    };
    const std::size_t step = std::min<std::size_t>(1, nodes - 1);
    fill(beyond, beyond + step, true);
    fill(beyond + nodes - 1, beyond + nodes - 1 - step, false);
}

}  // namespace

NodeSpline::Axis::Axis(std::size_t texels, std::size_t nodes) : weights(4 * texels)
{
    for (std::size_t i = 0; i < texels; ++i) {
        const double position =
            (static_cast<double>(i) + 0.5) * static_cast<double>(nodes) / static_cast<double>(texels) - 0.5;
        const double below = std::floor(position);
        const double t = position - below;
        first.push_back(static_cast<std::size_t>(below + static_cast<double>(beyond)) - 1);
        const std::array<double, 4> basis = {(1 - t) * (1 - t) * (1 - t) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                                             (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
        for (std::size_t k = 0; k < basis.size(); ++k)
            weights[k * texels + i] = static_cast<float>(basis[k]);
        if (position < 0.0)
            inner.first = i + 1;
        if (position <= static_cast<double>(nodes - 1))
            inner.second = i + 1;
    }
    inner.second = std::max(inner.first, inner.second);
}

NodeSpline::NodeSpline(std::size_t height, std::size_t width, std::size_t rows, std::size_t columns)
    : m_columns(columns + 2 * beyond), m_up(height, rows), m_across(width, columns)
{
}

std::vector<float> NodeSpline::coefficients(const float* values, std::size_t stride, std::size_t rows,
                                            std::size_t columns)
{
    const std::size_t line = columns + 2 * beyond;
    std::vector<float> result(line * (rows + 2 * beyond));
    for (std::size_t y = 0; y < rows; ++y) {
        float* row = result.data() + (y + beyond) * line;
        for (std::size_t x = 0; x < columns; ++x)
            row[x + beyond] = values[(y * columns + x) * stride];
        extend(row, 1, columns);
    }
    for (std::size_t x = 0; x < line; ++x)
        extend(result.data() + x, line, rows);
    return result;
}

void NodeSpline::row(std::size_t y, std::size_t first, std::size_t end, const float* coefficients,
                     std::vector<float>& scratch, float* texels) const
{
    const auto weights_of = [](const Axis& axis, std::size_t i) {
        const std::size_t count = axis.first.size();
        return std::array{axis.weights[i], axis.weights[count + i], axis.weights[2 * count + i],
                          axis.weights[3 * count + i]};
    };
    scratch.resize(m_columns);
    interpolate(scratch.data(), coefficients + m_up.first[y] * m_columns, m_columns, weights_of(m_up, y).data(),
                m_columns);
    // Texels between the same nodes share four coefficients, which take the part of the weights.
    const auto* node = m_across.first.data();
    for (std::size_t x = first, next = first; x < end; x = next) {
        next = static_cast<std::size_t>(std::upper_bound(node + x, node + end, node[x]) - node);
        interpolate(texels + x - first, m_across.weights.data() + x, m_across.first.size(), scratch.data() + node[x],
                    next - x);
    }
}

}  // namespace beamspread
