// Light of a plane, more and more coarsely: what a texel sees of light from far away.
#pragma once

#include <cstddef>
#include <vector>

#include "base/vec.h"
#include "solve/angle_counts.h"
#include "solve/light_field.h"

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

private:
    struct Level {
        std::size_t height = 0;
        std::size_t width = 0;
        std::vector<SquareBeam> beams;
    };

    static std::size_t squares(std::size_t texels, std::size_t level) { return ((texels - 1) >> level) + 1; }
    void add_up_texels();
    void add_up_squares(std::size_t y, std::size_t first, std::size_t end, Level& level, AngleCounts& angles) const;
    void add_texels(AngleCounts& angles, std::size_t y, std::size_t x) const;  // of a square

    LightField m_light;
    AngleCounts m_angles;
    std::size_t m_top = 0;
    std::vector<Level> m_levels;
};

}  // namespace beamspread
