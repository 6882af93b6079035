// A coarse grid of nodes: spreads light from texels to nodes, and interpolates luminance from nodes to texels.
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "solve/spectral/convolution.h"
#include "solve/spectral/spline_axis.h"

namespace beamspread {

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
