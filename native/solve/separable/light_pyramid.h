// Light of a plane, more and more coarsely: what a texel sees of light from far away.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/vec.h"
#include "solve/problem/light_field.h"
#include "solve/separable/angle_counts.h"

namespace beamspread {

// Light of a square of 2^level texels, as one beam. Squares (y, x) of a level lie side by side from texel (0, 0) on;
// those of level 0 are texels.
struct SquareBeam {
    float irradiance = 0.0f;  // sum over the texels
    Vec3f direction{0.0f};    // a unit vector, or zero where it is dark
};

class LightPyramid {
public:
    explicit LightPyramid(const LightField& light);

    // The first level that is stored, and the highest, which has one square.
    static constexpr std::size_t first_level = 2;
    std::size_t top() const { return m_top; }

    std::size_t height() const { return m_light.irradiance.height; }
    std::size_t width() const { return m_light.irradiance.width; }

    // Of the texels.
    const AngleCounts& angles() const { return m_angles; }

    // Dark beyond the plane.
    SquareBeam beam(std::size_t level, std::size_t y, std::size_t x) const;

    // The squares of the level that make up square (y, x) of the next: in a row, then in the row below.
    std::array<SquareBeam, 4> quarters(std::size_t level, std::size_t y, std::size_t x) const
    {
        if (level >= first_level) {
            const Level& stored = m_levels[level - first_level];
            if (2 * y + 1 < stored.height && 2 * x + 1 < stored.width) {
                const SquareBeam* above = stored.beams.data() + 2 * y * stored.width + 2 * x;
                const SquareBeam* below = above + stored.width;
                return {above[0], above[1], below[0], below[1]};
            }
        }
        return {beam(level, 2 * y, 2 * x), beam(level, 2 * y, 2 * x + 1), beam(level, 2 * y + 1, 2 * x),
                beam(level, 2 * y + 1, 2 * x + 1)};
    }

    // Of a level, along so many texels.
    static std::size_t squares(std::size_t texels, std::size_t level) { return ((texels - 1) >> level) + 1; }

private:
    struct Level {
        std::size_t height = 0;
        std::size_t width = 0;
        std::vector<SquareBeam> beams;
    };

    void add_up_texels();
    void add_up_squares(std::size_t row, std::size_t first, std::size_t end, Level& level, AngleCounts& angles) const;
    void add_texels(AngleCounts& angles, std::size_t y, std::size_t x) const;  // of a square

    LightField m_light;
    AngleCounts m_angles;
    std::size_t m_top = 0;
    std::vector<Level> m_levels;
};

}  // namespace beamspread
