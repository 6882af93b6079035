#include "solve/light_pyramid.h"

#include <array>

#include "base/threads.h"

namespace beamspread {

namespace {

// Mean directions this long stand for all; shorter ones are means of too different directions.
constexpr float even_length = 0.98f;

// The four squares that make up one of the next level: with their mean direction where directions hardly differ, else
// with that of the beam in the middle of the light.
SquareBeam merge(const std::array<SquareBeam, 4>& beams)
{
    SquareBeam sum;
    for (const SquareBeam& beam : beams) {
        sum.irradiance += beam.irradiance;
        sum.direction += beam.irradiance * beam.direction;
    }
    if (sum.irradiance == 0.0f)
        return {};
    const float length = glm::length(sum.direction);
    if (length >= even_length * sum.irradiance) {
        sum.direction /= length;
        return sum;
    }
    float passed = 0.0f;
    for (std::size_t i = 0; 2.0f * passed < sum.irradiance && i < beams.size(); ++i) {
        passed += beams[i].irradiance;
        if (beams[i].irradiance > 0.0f)
            sum.direction = beams[i].direction;
    }
    return sum;
}

// Of a light's texels.
template <std::size_t level>
SquareBeam add_up(const LightField& light, std::size_t y, std::size_t x)
{
    if constexpr (level > 0) {
        return merge({add_up<level - 1>(light, 2 * y, 2 * x), add_up<level - 1>(light, 2 * y, 2 * x + 1),
                      add_up<level - 1>(light, 2 * y + 1, 2 * x), add_up<level - 1>(light, 2 * y + 1, 2 * x + 1)});
    } else {
        const View2D<const float>& irradiance = light.irradiance;
        if (y >= irradiance.height || x >= irradiance.width || irradiance(y, x) == 0.0f)
            return {};
        const float* d = light.directions.field + 3 * (y * irradiance.width + x);
        return {irradiance(y, x), Vec3f(d[0], d[1], d[2])};
    }
}

}  // namespace

LightPyramid::LightPyramid(const LightField& light) : m_light(light)
{
    static_assert(first_level == 2);
    for (m_top = first_level;; ++m_top) {
        const auto squares = [&](std::size_t texels) { return ((texels - 1) >> m_top) + 1; };
        Level level{squares(height()), squares(width()), {}};
        level.beams.resize(level.height * level.width);
        parallel_for(level.height, [&](std::size_t y) {
            for (std::size_t x = 0; x < level.width; ++x)
                level.beams[y * level.width + x] =
                    m_top == first_level
                        ? add_up<first_level>(m_light, y, x)
                        : merge({beam(m_top - 1, 2 * y, 2 * x), beam(m_top - 1, 2 * y, 2 * x + 1),
                                 beam(m_top - 1, 2 * y + 1, 2 * x), beam(m_top - 1, 2 * y + 1, 2 * x + 1)});
        });
        m_levels.push_back(std::move(level));
        if (m_levels.back().beams.size() == 1)
            return;
    }
}

SquareBeam LightPyramid::beam(std::size_t level, std::size_t y, std::size_t x) const
{
    if (level == 0)
        return add_up<0>(m_light, y, x);
    if (level == 1)
        return add_up<1>(m_light, y, x);
    const Level& stored = m_levels[level - first_level];
    return y < stored.height && x < stored.width ? stored.beams[y * stored.width + x] : SquareBeam();
}

}  // namespace beamspread
