// Light of a plane, more and more coarsely: what a texel sees of light from far away.
#pragma once

#include <cstddef>
#include <vector>

#include "base/vec.h"
#include "solve/present_angles.h"

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

    // Dark beyond the plane.
    SquareBeam beam(std::size_t level, std::size_t y, std::size_t x) const;

private:
    struct Level {
        std::size_t height = 0;
        std::size_t width = 0;
        std::vector<SquareBeam> beams;
    };

    LightField m_light;
    std::size_t m_top = 0;
    std::vector<Level> m_levels;
};

}  // namespace beamspread
