// Smooth interpolation between coarse nodes of a plane.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace beamspread {

// Uniform cubic B-spline with coefficients at nodes that are evenly spread over a plane of texels. It averages noise.
// Coefficients beyond the border go on in a straight line, so that linear functions stay linear; there they may be below 0.
class NodeSpline {
public:
    NodeSpline(std::size_t height, std::size_t width, std::size_t rows, std::size_t columns);

    // Coefficients at all nodes and at two beyond each border, row by row. `values` has one per node, `stride` apart.
    static std::vector<float> coefficients(const float* values, std::size_t stride, std::size_t rows,
                                           std::size_t columns);

    // Writes texels [first, end) of a row. `scratch` is working memory.
    void row(std::size_t y, std::size_t first, std::size_t end, const float* coefficients, std::vector<float>& scratch,
             float* texels) const;

    // Rows and columns [first, second) of texels between the outermost nodes: no node counts negatively there.
    std::pair<std::size_t, std::size_t> inner_rows() const { return m_up.inner; }
    std::pair<std::size_t, std::size_t> inner_columns() const { return m_across.inner; }

private:
    struct Axis {
        Axis(std::size_t texels, std::size_t nodes);

        std::vector<std::size_t> first;  // [texel] the first of four coefficients
        std::vector<float> weights;      // [coefficient of four][texel]
        std::pair<std::size_t, std::size_t> inner;
    };

    std::size_t m_columns;  // with those beyond the border
    Axis m_up, m_across;
};

}  // namespace beamspread
