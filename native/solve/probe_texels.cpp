#include "solve/probe_texels.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/random.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Texels are drawn from squares of side x side, or from around them.
constexpr std::size_t level = 3;
constexpr std::size_t side = std::size_t{1} << level;

// How many are drawn: from all squares, from lit ones, and, more often where the light changes more from square to
// square, from within so many texels of one.
constexpr std::size_t anywhere = 200;
constexpr std::size_t lit = 400;
constexpr std::size_t near_border = 200;
constexpr std::array<std::size_t, 4> border_reach = {0, 8, 16, 32};

// And from around each square where a light is extreme.
constexpr std::size_t in_extreme = 24;
constexpr std::size_t near_extreme = 12;
constexpr std::array<std::size_t, 3> extreme_reach = {4, 12, 28};

// And around each single texel.
constexpr std::size_t per_texel = 8;
constexpr std::size_t texel_reach = 8;

struct Square {
    std::size_t y;
    std::size_t x;
};

// A number below `size` and at most `reach` outside of [first, first + count).
std::size_t draw_within(Random& random, std::size_t first, std::size_t count, std::size_t reach, std::size_t size)
{
    const std::size_t low = first - std::min(first, reach);
    const std::size_t end = std::min(size, first + count + reach);
    return low + static_cast<std::size_t>(random.uniform() * static_cast<double>(end - low));
}

class Sampler {
public:
    explicit Sampler(const std::vector<LightPyramid>& lights)
        : m_height(lights.front().height()),
          m_width(lights.front().width()),
          m_rows((m_height + side - 1) / side),
          m_columns((m_width + side - 1) / side),
          m_random(0, 0, 0)
    {
    }

    std::size_t rows() const { return m_rows; }
    std::size_t columns() const { return m_columns; }

    // Texels at most `reach` texels outside of squares, which are drawn in proportion to their weights.
    void draw(const std::vector<float>& weights, std::size_t count, std::size_t reach, std::vector<Texel>& texels)
    {
        const double step = std::accumulate(weights.begin(), weights.end(), 0.0) / static_cast<double>(count);
        if (step == 0.0)
            return;
        double next = step * m_random.uniform();
        double sum = 0.0;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            sum += static_cast<double>(weights[i]);
            while (next < sum) {
                texels.push_back(draw_near({i / m_columns, i % m_columns}, reach));
                next += step;
            }
        }
    }

    Texel draw_near(const Square& square, std::size_t reach)
    {
        const std::size_t y = draw_within(m_random, square.y * side, side, reach, m_height);
        return {y, draw_within(m_random, square.x * side, side, reach, m_width)};
    }

private:
    std::size_t m_height;
    std::size_t m_width;
    std::size_t m_rows;
    std::size_t m_columns;
    Random m_random;
};

// By how much the light of a square differs from that of the next ones, relative to the light of all three.
float change(const std::vector<LightPyramid>& lights, const Square& square)
{
    float difference = 0.0f;
    float sum = 0.0f;
    for (const LightPyramid& light : lights) {
        const SquareBeam here = light.beam(level, square.y, square.x);
        for (const Square& next : {Square{square.y + 1, square.x}, Square{square.y, square.x + 1}}) {
            const SquareBeam there = light.beam(level, next.y, next.x);
            difference += glm::length(here.irradiance * here.direction - there.irradiance * there.direction);
            sum += here.irradiance + there.irradiance;
        }
    }
    return sum > 0.0f ? difference / sum : 0.0f;
}

// Where a light is brightest, steepest and most grazing: angles that few texels have are easily missed.
std::array<Square, 3> extremes(const LightPyramid& light, const Sampler& plane)
{
    std::array<Square, 3> found{};
    std::array<float, 3> most{0.0f, 0.0f, 0.0f};
    for (std::size_t y = 0; y < plane.rows(); ++y)
        for (std::size_t x = 0; x < plane.columns(); ++x) {
            const SquareBeam beam = light.beam(level, y, x);
            if (beam.irradiance == 0.0f)
                continue;
            const std::array<float, 3> values{beam.irradiance, -beam.direction.z, 1.0f + beam.direction.z};
            for (std::size_t i = 0; i < values.size(); ++i)
                if (values[i] > most[i]) {
                    most[i] = values[i];
                    found[i] = {y, x};
                }
        }
    return found;
}

}  // namespace

std::vector<Texel> probe_texels(const std::vector<LightPyramid>& lights)
{
    Sampler sampler(lights);
    const std::size_t squares = sampler.rows() * sampler.columns();
    std::vector<float> is_lit(squares, 0.0f);
    std::vector<float> changes(squares);
    parallel_for(sampler.rows(), [&](std::size_t y) {
        for (std::size_t x = 0; x < sampler.columns(); ++x) {
            const std::size_t i = y * sampler.columns() + x;
            for (const LightPyramid& light : lights)
                if (light.beam(level, y, x).irradiance > 0.0f)
                    is_lit[i] = 1.0f;
            changes[i] = change(lights, {y, x});
        }
    });
    std::vector<Texel> texels;
    sampler.draw(std::vector<float>(squares, 1.0f), anywhere, 0, texels);
    sampler.draw(is_lit, lit, 0, texels);
    for (const std::size_t reach : border_reach)
        sampler.draw(changes, near_border, reach, texels);
    for (const LightPyramid& light : lights)
        for (const Square& square : extremes(light, sampler)) {
            for (std::size_t n = 0; n < in_extreme; ++n)
                texels.push_back(sampler.draw_near(square, 0));
            for (const std::size_t reach : extreme_reach)
                for (std::size_t n = 0; n < near_extreme; ++n)
                    texels.push_back(sampler.draw_near(square, reach));
        }
    return texels;
}

std::vector<Texel> texels_around(const std::vector<Texel>& texels, std::size_t height, std::size_t width,
                                 std::size_t draw)
{
    Random random(0, 1, draw);
    std::vector<Texel> around;
    for (const Texel& texel : texels)
        for (std::size_t n = 0; n < per_texel; ++n) {
            const std::size_t y = draw_within(random, texel.y, 1, texel_reach, height);
            around.push_back({y, draw_within(random, texel.x, 1, texel_reach, width)});
        }
    return around;
}

}  // namespace beamspread
