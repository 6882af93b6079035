#include "solve/spectral/coarse_grid.h"

#include <algorithm>

#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

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

}  // namespace beamspread
