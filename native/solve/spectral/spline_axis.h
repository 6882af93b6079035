// Values on texels by way of a coarser grid.
#pragma once

#include <cstddef>
#include <vector>

namespace beamspread {

// Order of the splines: polynomials of one degree less.
inline constexpr std::size_t spline_order = 8;

// Texels along one axis, and nodes several texels apart: cardinal B-splines around the nodes take values from texels to
// nodes, and back. The first node lies spline_order / 2 - 1 steps before the first texel. A detail of wave number k
// comes with images of it, of relative size (k / (2 pi / step - k))^spline_order.
class SplineAxis {
public:
    SplineAxis(std::size_t size, std::size_t step);

    std::size_t nodes() const { return m_nodes; }
    std::size_t step() const { return m_step; }

    // A texel's weights at spline_order nodes, the first of which is that of number texel / step().
    const float* weights(std::size_t texel) const { return m_weights.data() + texel % m_step * spline_order; }

    // The transform of the splines, by which a spectrum on the nodes differs from that on the texels, at `turns` per
    // step.
    static double response(double turns);

    // nodes[n] = the sum of all texels with their weights. `scratch` is resized as needed.
    void spread(const float* texels, float* nodes, std::vector<float>& scratch) const;

    // Adds the values at `count` texels from `first` on.
    void add_interpolated(const float* nodes, std::size_t first, std::size_t count, float* texels,
                          std::vector<float>& scratch) const;

private:
    std::size_t m_size;
    std::size_t m_step;
    std::size_t m_nodes;
    std::vector<float> m_weights;  // [texel % step][node]
};

}  // namespace beamspread
