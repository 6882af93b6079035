// Texels of a mesh that bends at steps that halve, where values follow from those around: few have to be solved where
// light is smooth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "scene/receiver.h"

namespace beamspread {

// Texels and weights of an interpolated value.
struct Stencil {
    std::size_t count = 0;
    std::array<std::size_t, 8> texel{};
    std::array<float, 8> weight{};

    template <class Read>
    auto operator()(const Read& value_of) const
    {
        auto sum = weight[0] * value_of(texel[0]);
        for (std::size_t i = 1; i < count; ++i)
            sum += weight[i] * value_of(texel[i]);
        return sum;
    }
};

class NestedTexels {
public:
    // Steps in texels. Texels of the first one don't follow from others.
    static constexpr std::array<std::size_t, 3> steps = {4, 2, 1};

    // `is_whole`: [texel] not 0 inside the mesh where texels can be interpolated and interpolated from.
    NestedTexels(const ReceiverGrid& grid, std::vector<std::uint8_t> is_whole);

    bool is_whole(std::size_t texel) const { return m_is_whole[texel] != 0; }
    std::size_t width() const { return m_width; }
    std::size_t height() const { return m_height; }

    // A texel that is one of this step, and not of twice the step. Those of one kind lie between two texels of twice the
    // step; others follow from them.
    struct Place {
        std::size_t x, y;
        bool is_between_two;
    };

    // Visits whole texels of a step alone; rows at once.
    void for_each(std::size_t step, const std::function<void(const Place&)>& visit) const;

    // The cubic through texels along the row or the column, or the mean of both (Deslauriers and Dubuc 1989,
    // doi:10.1007/BF01889598); at the end of a run of neighbors a parabola, without neighbors nothing.
    Stencil stencil(const Place& place, std::size_t step) const;

private:
    std::size_t m_width;
    std::size_t m_height;
    std::vector<std::uint8_t> m_is_whole;
    std::vector<std::uint32_t> m_row_runs,
        m_column_runs;  // [texel] number of its run of neighbors on the mesh; 0: none
};

}  // namespace beamspread
