#include "solve/light_pyramid.h"

#include "base/threads.h"

namespace beamspread {

namespace {

using Beam = LightPyramid::Beam;

// Mean directions this long stand for all; shorter ones are means of too different directions.
constexpr float even_length = 0.98f;

// Square beams side by side, added up: with their mean direction where directions hardly differ, else with that of the
// beam in the middle of the light.
template <class BeamAt>
Beam merge(std::size_t count, const BeamAt& beam_at)
{
    Beam sum;
    for (std::size_t i = 0; i < count; ++i) {
        const Beam beam = beam_at(i);
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
    for (std::size_t i = 0; i < count && 2.0f * passed < sum.irradiance; ++i) {
        const Beam beam = beam_at(i);
        passed += beam.irradiance;
        if (beam.irradiance > 0.0f)
            sum.direction = beam.direction;
    }
    return sum;
}

}  // namespace

LightPyramid::LightPyramid(const LightField& light) : m_light(light)
{
    std::size_t height = light.irradiance.height;
    std::size_t width = light.irradiance.width;
    for (std::size_t level = 0; level < first_level; ++level) {
        height = (height + 1) / 2;
        width = (width + 1) / 2;
    }
    for (m_top = first_level;; ++m_top) {
        Level next{height, width, std::vector<Beam>(height * width)};
        const std::size_t below = m_levels.empty() ? 0 : m_top - 1;
        const std::size_t side = std::size_t{1} << (m_top - below);
        parallel_for(height, [&](std::size_t y) {
            for (std::size_t x = 0; x < width; ++x)
                next.beams[y * width + x] = merge(
                    side * side, [&](std::size_t i) { return beam(below, y * side + i / side, x * side + i % side); });
        });
        m_levels.push_back(std::move(next));
        if (height * width == 1)
            return;
        height = (height + 1) / 2;
        width = (width + 1) / 2;
    }
}

Beam LightPyramid::beam(std::size_t level, std::size_t y, std::size_t x) const
{
    if (level == 0)
        return texel(y, x);
    if (level < first_level) {
        const std::size_t side = std::size_t{1} << level;
        return merge(side * side, [&](std::size_t i) { return texel(y * side + i / side, x * side + i % side); });
    }
    const Level& stored = m_levels[level - first_level];
    return y < stored.height && x < stored.width ? stored.beams[y * stored.width + x] : Beam();
}

}  // namespace beamspread
