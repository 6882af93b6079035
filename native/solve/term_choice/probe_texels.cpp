#include "solve/term_choice/probe_texels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

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

// Corners of shadows, each with the four texels that meet there: where light stays within texels these err unlike any
// other, and are too few to be met by chance.
constexpr std::size_t corners = 40;
constexpr float least_change = 0.1f;  // along both sides, relative to the light

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

    // Squares in proportion to their weights.
    std::vector<Square> draw(const std::vector<float>& weights, std::size_t count)
    {
        std::vector<Square> drawn;
        const double step = std::accumulate(weights.begin(), weights.end(), 0.0) / static_cast<double>(count);
        if (step == 0.0)
            return drawn;
        double next = step * m_random.uniform();
        double sum = 0.0;
        for (std::size_t i = 0; i < weights.size(); ++i) {
            sum += static_cast<double>(weights[i]);
            while (next < sum) {
                drawn.push_back({i / m_columns, i % m_columns});
                next += step;
            }
        }
        return drawn;
    }

    // Texels at most `reach` texels outside of such squares.
    void draw(const std::vector<float>& weights, std::size_t count, std::size_t reach, std::vector<Texel>& texels)
    {
        for (const Square& square : draw(weights, count))
            texels.push_back(draw_near(square, reach));
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

// By how much light differs between squares of a level that share a side, along x and along y, relative to the light of
// the four squares (y, x) to (y + 1, x + 1).
struct Change {
    float x = 0.0f;
    float y = 0.0f;
};

Change change(const std::vector<LightPyramid>& lights, std::size_t at_level, std::size_t y, std::size_t x)
{
    Change found;
    float sum = 0.0f;
    for (const LightPyramid& light : lights) {
        std::array<SquareBeam, 4> beams;
        for (std::size_t i = 0; i < beams.size(); ++i) {
            beams[i] = light.beam(at_level, y + i / 2, x + i % 2);
            sum += beams[i].irradiance;
        }
        const auto difference = [&](std::size_t a, std::size_t b) {
            return glm::length(beams[a].irradiance * beams[a].direction - beams[b].irradiance * beams[b].direction);
        };
        found.x += difference(0, 1) + difference(2, 3);
        found.y += difference(0, 2) + difference(1, 3);
    }
    return sum > 0.0f ? Change{found.x / sum, found.y / sum} : Change{};
}

// The four texels that meet where the light of a square changes most along both sides at once.
void add_corner(const std::vector<LightPyramid>& lights, const Square& square, std::vector<Texel>& texels)
{
    const std::size_t height = lights.front().height();
    const std::size_t width = lights.front().width();
    Texel corner{0, 0};
    float most = 0.0f;
    for (std::size_t y = square.y * side; y < std::min(height - 1, (square.y + 1) * side); ++y)
        for (std::size_t x = square.x * side; x < std::min(width - 1, (square.x + 1) * side); ++x) {
            const Change here = change(lights, 0, y, x);
            if (here.x * here.y > most) {
                most = here.x * here.y;
                corner = {y, x};
            }
        }
    if (most > 0.0f)
        for (std::size_t i = 0; i < 4; ++i)
            texels.push_back({corner.y + i / 2, corner.x + i % 2});
}

// Where a light is brightest, steepest and most grazing: angles that few texels have are easily missed.
std::vector<Square> extremes(const LightPyramid& light, const Sampler& plane)
{
    std::vector<Square> found(3);
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

// The place that all beams of a lamp travel away from: around it harmonics of any order add up with the same sign, also
// where it is dark. In general the one that is nearest to the lines that beams travel along; none if they are parallel.
std::optional<Square> origin(const LightPyramid& light, const Sampler& plane, double pitch_x, double pitch_y)
{
    // Sums of I - d d^T and of its product with the place, d along the plane, lengths in squares.
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    double bx = 0.0;
    double by = 0.0;
    for (std::size_t y = 0; y < plane.rows(); ++y)
        for (std::size_t x = 0; x < plane.columns(); ++x) {
            const SquareBeam beam = light.beam(level, y, x);
            const double dx = static_cast<double>(beam.direction.x) / pitch_x;
            const double dy = static_cast<double>(beam.direction.y) / pitch_y;
            const double square = dx * dx + dy * dy;
            if (square == 0.0)
                continue;
            const auto at_x = static_cast<double>(x);
            const auto at_y = static_cast<double>(y);
            xx += dy * dy / square;
            xy -= dx * dy / square;
            yy += dx * dx / square;
            bx += dy * (dy * at_x - dx * at_y) / square;
            by += dx * (dx * at_y - dy * at_x) / square;
        }
    constexpr double parallel = 1e-6;
    const double determinant = xx * yy - xy * xy;
    if (determinant <= parallel * (xx + yy) * (xx + yy))
        return std::nullopt;
    const double x = std::round((yy * bx - xy * by) / determinant);
    const double y = std::round((xx * by - xy * bx) / determinant);
    if (x < 0.0 || y < 0.0 || x >= static_cast<double>(plane.columns()) || y >= static_cast<double>(plane.rows()))
        return std::nullopt;
    return Square{static_cast<std::size_t>(y), static_cast<std::size_t>(x)};
}

}  // namespace

std::vector<Texel> probe_texels(const std::vector<LightPyramid>& lights, double pitch_x, double pitch_y)
{
    Sampler sampler(lights);
    const std::size_t squares = sampler.rows() * sampler.columns();
    std::vector<float> is_lit(squares, 0.0f);
    std::vector<float> changes(squares);
    std::vector<float> corner_changes(squares, 0.0f);
    parallel_for(sampler.rows(), [&](std::size_t y) {
        for (std::size_t x = 0; x < sampler.columns(); ++x) {
            const std::size_t i = y * sampler.columns() + x;
            for (const LightPyramid& light : lights)
                if (light.beam(level, y, x).irradiance > 0.0f)
                    is_lit[i] = 1.0f;
            const Change here = change(lights, level, y, x);
            changes[i] = here.x + here.y;
            if (y + 1 < sampler.rows() && x + 1 < sampler.columns() && std::min(here.x, here.y) > least_change)
                corner_changes[i] = here.x * here.y;
        }
    });
    std::vector<Texel> texels;
    sampler.draw(std::vector<float>(squares, 1.0f), anywhere, 0, texels);
    sampler.draw(is_lit, lit, 0, texels);
    for (const std::size_t reach : border_reach)
        sampler.draw(changes, near_border, reach, texels);
    std::optional<Square> last;
    for (const Square& square : sampler.draw(corner_changes, corners)) {
        if (!last || square.y != last->y || square.x != last->x)
            add_corner(lights, square, texels);
        last = square;
    }
    for (const LightPyramid& light : lights) {
        std::vector<Square> places = extremes(light, sampler);
        const std::optional<Square> from = origin(light, sampler, pitch_x, pitch_y);
        if (from && light.beam(level, from->y, from->x).irradiance == 0.0f)  // else it is where light is steepest
            places.push_back(*from);
        for (const Square& square : places) {
            for (std::size_t n = 0; n < in_extreme; ++n)
                texels.push_back(sampler.draw_near(square, 0));
            for (const std::size_t reach : extreme_reach)
                for (std::size_t n = 0; n < near_extreme; ++n)
                    texels.push_back(sampler.draw_near(square, reach));
        }
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
