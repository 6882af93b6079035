#include "solve/separable/light_pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/threads.h"
#include "simd/loops.h"
#include "solve/problem/beam_loops.h"

namespace beamspread {

namespace {

// Mean directions this long stand for all; shorter ones are means of too different directions.
constexpr float even_length = 0.98f;

// Of texels whose angles are all the same to about a quarter of a degree.
constexpr float one_angle_length = 0.99999f;

// Rows of squares, and squares whose sums are in the cache at once.
constexpr std::size_t rows_per_item = 8;
constexpr std::size_t squares_at_once = 64;

double half_tangent(const Vec3f& direction)
{
    return static_cast<double>(std::sqrt(direction.x * direction.x + direction.y * direction.y) / (1.0f - direction.z));
}

// Of the sum of directions times irradiance, makes the mean direction, if it is at least so long.
bool normalize(SquareBeam& sum, float least_length)
{
    const float length = glm::length(sum.direction);
    if (length < least_length * sum.irradiance)
        return false;
    if (length > 0.0f)
        sum.direction *= 1.0f / length;
    return true;
}

// The four squares that make up one of the next level: with their mean direction where directions hardly differ, else
// with that of the beam in the middle of the light.
SquareBeam merge(const std::array<SquareBeam, 4>& beams)
{
    SquareBeam sum;
    for (const SquareBeam& beam : beams) {
        sum.irradiance += beam.irradiance;
        sum.direction += beam.irradiance * beam.direction;
    }
    if (normalize(sum, even_length))
        return sum;
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
    add_up_texels();
    while (m_levels.back().beams.size() > 1) {
        ++m_top;
        Level level{squares(height(), m_top), squares(width(), m_top), {}};
        level.beams.resize(level.height * level.width);
        parallel_for(level.height, [&](std::size_t y) {
            for (std::size_t x = 0; x < level.width; ++x)
                level.beams[y * level.width + x] = merge(quarters(m_top - 1, y, x));
        });
        m_levels.push_back(std::move(level));
    }
}

void LightPyramid::add_up_texels()
{
    m_top = first_level;
    Level level{squares(height(), m_top), squares(width(), m_top), {}};
    level.beams.resize(level.height * level.width);
    parallel_ordered<AngleCounts>(
        (level.height + rows_per_item - 1) / rows_per_item,
        [&](std::size_t item) {
            AngleCounts angles;
            for (std::size_t y = item * rows_per_item; y < std::min(level.height, (item + 1) * rows_per_item); ++y)
                for (std::size_t x = 0; x < level.width; x += squares_at_once)
                    add_up_squares(y, x, std::min(level.width, x + squares_at_once), level, angles);
            return angles;
        },
        [&](std::size_t, const AngleCounts& angles) { m_angles.add(angles); });
    m_levels.push_back(std::move(level));
}

void LightPyramid::add_texels(AngleCounts& angles, std::size_t y, std::size_t x) const
{
    constexpr std::size_t side = std::size_t{1} << first_level;
    for (std::size_t i = 0; i < side * side; ++i) {
        const SquareBeam texel = beam(0, y * side + i / side, x * side + i % side);
        if (texel.irradiance > 0.0f)
            angles.add(half_tangent(texel.direction), static_cast<double>(texel.irradiance), 1.0);
    }
}

// Squares [first, end) of a row. Every texel is read here: all that is needed of it is found at once.
void LightPyramid::add_up_squares(std::size_t row, std::size_t first, std::size_t end, Level& level,
                                  AngleCounts& angles) const
{
    constexpr std::size_t side = std::size_t{1} << first_level;
    static_assert(side == 4);
    using Columns = std::array<float, side * squares_at_once>;
    Columns irradiance;
    Columns half_tangents;
    std::array<Columns, 5> sums{};  // of light, of its x, y, z, and of lit texels
    auto& [power, to_x, to_y, to_z, texels] = sums;
    Columns least;
    Columns most{};
    least.fill(1.0f);
    const std::size_t texel = first * side;
    const std::size_t count = std::min(width(), end * side) - texel;
    for (std::size_t line = row * side; line < std::min(height(), (row + 1) * side); ++line) {
        copy_row(m_light.irradiance, line, texel, count, irradiance.data());
        add_light(power.data(), to_x.data(), to_y.data(), to_z.data(), half_tangents.data(), irradiance.data(),
                  m_light.directions.field + 3 * (line * width() + texel), count);
        add_lit(texels.data(), least.data(), most.data(), half_tangents.data(), irradiance.data(), count);
    }
    angles.include(*std::min_element(least.begin(), least.end()), *std::max_element(most.begin(), most.end()));
    using Squares = std::array<float, squares_at_once>;
    std::array<Squares, 5> of_squares;
    for (std::size_t i = 0; i < sums.size(); ++i)
        add_fours(of_squares[i].data(), sums[i].data(), squares_at_once);
    auto& [light, x, y, z, lit] = of_squares;
    Squares length;
    Squares half_tangent;
    make_unit(x.data(), y.data(), z.data(), length.data(), half_tangent.data(), squares_at_once);
    for (std::size_t i = 0; i < end - first; ++i) {
        if (light[i] == 0.0f)
            continue;
        SquareBeam& beam = level.beams[row * level.width + first + i];
        beam = {light[i], Vec3f(x[i], y[i], z[i])};
        if (length[i] >= one_angle_length * light[i]) {
            angles.add(static_cast<double>(half_tangent[i]), static_cast<double>(light[i]),
                       static_cast<double>(lit[i]));
            continue;
        }
        add_texels(angles, row, first + i);
        if (length[i] < even_length * light[i])
            beam = add_up<first_level>(m_light, row, first + i);
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
