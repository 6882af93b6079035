#include "solve/spectral/convolution.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Values of the spline M(u + s), s = 0 .. spline_order - 1, by the recursion of cardinal B-splines on [0, order]:
//   M_(n+1)(t) = t / n M_n(t) + (n + 1 - t) / n M_n(t - 1).
std::array<double, spline_order> spline_values(double u)
{
    std::array<double, spline_order> values{1.0};
    for (std::size_t n = 1; n < spline_order; ++n) {
        const auto order = static_cast<double>(n);
        for (std::size_t s = n + 1; s-- > 0;) {
            const double t = u + static_cast<double>(s);
            values[s] = (t * values[s] + (s > 0 ? (order + 1.0 - t) * values[s - 1] : 0.0)) / order;
        }
    }
    return values;
}

}  // namespace

std::vector<float> CoarseGrid::spread(const MakeLightRow& light, std::size_t first, std::size_t count,
                                      Progress& progress, double work) const
{
    struct RowScratch : Scratch {
        LightRow light;
    };
    PerThread<RowScratch> pool;
    const std::size_t stride = m_x.nodes();
    const std::size_t step = m_y.step();
    const std::size_t items = (m_height + step - 1) / step;
    std::vector<float> result(count * nodes(), 0.0f);
    // Compute the light of an item's texel rows, which go to the same rows of nodes: [term][row][node].
    const auto spread_rows = [&](std::size_t item) {
        std::vector<float> rows(count * spline_order * stride, 0.0f);
        RowScratch& scratch = pool.local();
        if (!scratch.light)
            scratch.light = light();
        scratch.nodes.resize(stride);
        for (std::size_t y = item * step; y < std::min(m_height, (item + 1) * step); ++y) {
            const float* weights = m_y.weights(y);
            const TermValues texels = scratch.light({y, 0, m_width}, first, count);
            for (std::size_t t = 0; t < count; ++t) {
                m_x.spread(texels.values + t * texels.stride, scratch.nodes.data(), scratch.line);
                for (std::size_t row = 0; row < spline_order; ++row)
                    add_scaled(rows.data() + (t * spline_order + row) * stride, scratch.nodes.data(), weights[row],
                               stride);
            }
        }
        progress.advance(work / static_cast<double>(items));
        return rows;
    };
    parallel_ordered(items, [&](std::size_t item) {
        return [&, item, rows = spread_rows(item)] {
            for (std::size_t t = 0; t < count; ++t)
                add_scaled(result.data() + t * nodes() + item * stride, rows.data() + t * spline_order * stride, 1.0f,
                           spline_order * stride);
        };
    });
    return result;
}

void CoarseGrid::add_interpolated(const std::vector<float>& nodes, const RowSpan& span, float* texels,
                                  Scratch& scratch) const
{
    const std::size_t stride = m_x.nodes();
    const float* weights = m_y.weights(span.y);
    const float* rows = nodes.data() + span.y / m_y.step() * stride;
    scratch.nodes.resize(stride);
    scale(scratch.nodes.data(), rows, weights[0], stride);
    for (std::size_t row = 1; row < spline_order; ++row)
        add_scaled(scratch.nodes.data(), rows + row * stride, weights[row], stride);
    m_x.add_interpolated(scratch.nodes.data(), span.x, span.width, texels, scratch.line);
}

SplineAxis::SplineAxis(std::size_t size, std::size_t step)
    : m_size(size), m_step(step), m_nodes((size + step - 1) / step + spline_order - 1)
{
    for (std::size_t texel = 0; texel < step; ++texel) {
        const auto values = spline_values(static_cast<double>(texel) / static_cast<double>(step));
        for (std::size_t node = 0; node < spline_order; ++node)
            m_weights.push_back(static_cast<float>(values[spline_order - 1 - node]));
    }
}

double SplineAxis::response(double turns)
{
    const double x = pi * turns;
    return x == 0.0 ? 1.0 : std::pow(std::sin(x) / x, static_cast<int>(spline_order));
}

void SplineAxis::spread(const float* texels, float* nodes, std::vector<float>& scratch) const
{
    std::fill_n(nodes, m_nodes, 0.0f);
    scratch.resize(m_nodes);
    for (std::size_t phase = 0; phase < std::min(m_step, m_size); ++phase) {
        // Collect the texels of equal weights.
        const std::size_t count = (m_size - phase + m_step - 1) / m_step;
        for (std::size_t i = 0; i < count; ++i)
            scratch[i] = texels[phase + i * m_step];
        for (std::size_t node = 0; node < spline_order; ++node)
            add_scaled(nodes + node, scratch.data(), weights(phase)[node], count);
    }
}

void SplineAxis::add_interpolated(const float* nodes, std::size_t first, std::size_t count, float* texels,
                                  std::vector<float>& scratch) const
{
    scratch.resize(m_nodes);
    for (std::size_t offset = 0; offset < std::min(m_step, count); ++offset) {
        const std::size_t texel = first + offset;
        const std::size_t same = (count - offset + m_step - 1) / m_step;
        const float* weight = weights(texel);
        const float* start = nodes + texel / m_step;
        scale(scratch.data(), start, weight[0], same);
        for (std::size_t node = 1; node < spline_order; ++node)
            add_scaled(scratch.data(), start + node, weight[node], same);
        for (std::size_t i = 0; i < same; ++i)
            texels[offset + i * m_step] += scratch[i];
    }
}

}  // namespace beamspread
