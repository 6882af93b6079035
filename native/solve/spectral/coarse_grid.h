// Coarse grids: splines between texels and nodes, light spread to the nodes, and luminance interpolated from them.
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "solve/spectral/convolution.h"

namespace beamspread {

// Order of the splines: one more than their polynomials' degree. Larger: smaller errors, more time.
inline constexpr std::size_t spline_order = 8;

// Texels along one axis, and nodes `step` texels apart. Cardinal B-splines (Schoenberg 1973,
// doi:10.1137/1.9781611970555) around the nodes take values from texels to nodes and back. The first node lies
// spline_order / 2 - 1 steps before the first texel. A detail of wave number k gets aliases of relative size
//   (k / (2 pi / step - k))^spline_order.
class SplineAxis {
public:
    SplineAxis(std::size_t size, std::size_t step);

    std::size_t nodes() const { return m_nodes; }
    std::size_t step() const { return m_step; }

    // A texel's weights at the spline_order nodes from node texel / step().
    const float* weights(std::size_t texel) const { return m_weights.data() + texel % m_step * spline_order; }

    // Fourier transform of a spline at `turns` per step: the factor between spectra on the nodes and on the texels.
    static double response(double turns);

    // Sets the nodes to the weighted sums of all texels. `scratch` is resized as needed.
    void spread(const float* texels, float* nodes, std::vector<float>& scratch) const;

    // Adds the interpolated values of texels [first, first + count).
    void add_interpolated(const float* nodes, std::size_t first, std::size_t count, float* texels,
                          std::vector<float>& scratch) const;

private:
    std::size_t m_size;
    std::size_t m_step;
    std::size_t m_nodes;
    std::vector<float> m_weights;  // [texel % step][node]
};

// Spreads light from the texels of a plane to the nodes of a coarse grid, and interpolates luminance from them.
class CoarseGrid {
public:
    // `nodes` is the coarse grid of a plane of (height, width) texels.
    CoarseGrid(const PaddedPlane& nodes, std::size_t width, std::size_t height)
        : m_width(width), m_height(height), m_x(width, nodes.texels_x), m_y(height, nodes.texels_y)
    {
    }

    std::size_t nodes() const { return m_x.nodes() * m_y.nodes(); }

    // Light of terms [first, first + count) on the nodes, [term][node]. Advances the progress by `work`.
    std::vector<float> spread(const MakeLightRow& light, std::size_t first, std::size_t count, Progress& progress,
                              double work) const;

    struct Scratch {
        std::vector<float> nodes;
        std::vector<float> line;
    };

    // Adds the interpolated values of a row of texels.
    void add_interpolated(const std::vector<float>& nodes, const RowSpan& span, float* texels, Scratch& scratch) const;

private:
    std::size_t m_width;
    std::size_t m_height;
    SplineAxis m_x;
    SplineAxis m_y;
};

}  // namespace beamspread
