// Light of a plane, more and more coarsely: what a texel sees of light from far away.
#pragma once

#include <cstddef>
#include <vector>

#include "base/vec.h"
#include "solve/present_angles.h"

namespace beamspread {

class LightPyramid {
public:
    explicit LightPyramid(const LightField& light);

    // Light of a square of 2^level texels, as one beam.
    struct Beam {
        float irradiance = 0.0f;  // sum over the texels
        Vec3f direction{0.0f};    // a unit vector, or zero where it is dark
    };

    // Square (y, x) of those side by side from texel (0, 0) on; level 0: texels.
    Beam beam(std::size_t level, std::size_t y, std::size_t x) const;

    std::size_t height() const { return m_light.irradiance.height; }
    std::size_t width() const { return m_light.irradiance.width; }

    // The highest level has one square.
    std::size_t top() const { return m_top; }

    // The first level that is stored: light of lower ones is added up when it is asked for.
    static constexpr std::size_t first_level = 3;

private:
    Beam texel(std::size_t y, std::size_t x) const
    {
        const View2D<const float>& irradiance = m_light.irradiance;
        if (y >= irradiance.height || x >= irradiance.width || irradiance(y, x) == 0.0f)
            return {};
        const float* d = m_light.directions.field + 3 * (y * irradiance.width + x);
        return {irradiance(y, x), Vec3f(d[0], d[1], d[2])};
    }

    struct Level {
        std::size_t height = 0;
        std::size_t width = 0;
        std::vector<Beam> beams;
    };

    LightField m_light;
    std::size_t m_top = 0;
    std::vector<Level> m_levels;
};

}  // namespace beamspread
