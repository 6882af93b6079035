// A map that is shown with another number of texels, each of which has the value of the nearest one.
#pragma once

#include <cstddef>
#include <vector>

#include "base/view.h"

namespace beamspread {

class NearestTexels {
public:
    NearestTexels(const View2D<const float>& map, std::size_t height, std::size_t width)
        : m_map(map), m_rows(indices(map.height, height)), m_columns(indices(map.width, width))
    {
    }

    float operator()(std::size_t y, std::size_t x) const { return m_map(m_rows[y], m_columns[x]); }

private:
    // The texel, of `known` along an axis, at the middle of each of `shown`.
    static std::vector<std::size_t> indices(std::size_t known, std::size_t shown)
    {
        std::vector<std::size_t> nearest(shown);
        for (std::size_t i = 0; i < shown; ++i)
            nearest[i] = (2 * i + 1) * known / (2 * shown);
        return nearest;
    }

    View2D<const float> m_map;
    std::vector<std::size_t> m_rows;
    std::vector<std::size_t> m_columns;
};

}  // namespace beamspread
