// Light brought from texels to the nodes of a coarse grid, and luminance brought back.
#pragma once

#include <cstddef>
#include <vector>

#include "base/progress.h"
#include "solve/spectral/convolution.h"
#include "solve/spectral/spline_axis.h"

namespace beamspread {

class CoarseGrid {
public:
    // `nodes`: the grid that stands for a plane of (height, width) texels.
    CoarseGrid(const PaddedPlane& nodes, std::size_t width, std::size_t height)
        : m_width(width), m_height(height), m_x(width, nodes.texels_x), m_y(height, nodes.texels_y)
    {
    }

    std::size_t nodes() const { return m_x.nodes() * m_y.nodes(); }

    // `count` terms of the light from `first` on, [term][node]. Advances the progress by `work`.
    std::vector<float> spread(const MakeLightRow& light, std::size_t first, std::size_t count, Progress& progress,
                              double work) const;

    struct Scratch {
        std::vector<float> nodes;
        std::vector<float> line;
    };

    // Adds the values that a row of texels reads off the nodes.
    void add_interpolated(const std::vector<float>& nodes, const RowSpan& span, float* texels, Scratch& scratch) const;

private:
    std::size_t m_width;
    std::size_t m_height;
    SplineAxis m_x;
    SplineAxis m_y;
};

}  // namespace beamspread
