#include "solve/adaptive/multilevel_sum.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/threads.h"

namespace beamspread {

namespace {

// Smallest number of points of an axis that is halved. Larger: fewer levels, more time.
constexpr double min_halved_size = 32.0;

// w(s) = (1 - (1 - s^2)^4)^4, s the distance over the near radius. Its derivatives up to the third vanish at 1, as
// cubic interpolation needs; the eighth order at 0 compensates the kernels' pole.
double window(double s)
{
    const double inside = std::max(0.0, 1.0 - s * s);
    return std::pow(1.0 - std::pow(inside, 4), 4);
}

}  // namespace

std::vector<GridLevel> grid_levels(std::size_t height, std::size_t width, double pitch_y, double pitch_x, double near)
{
    std::vector<GridLevel> levels;
    while (true) {
        const double min_size = std::max(min_halved_size, 2.0 * near);
        GridLevel level{height,
                        width,
                        pitch_y,
                        pitch_x,
                        static_cast<double>(height) >= min_size,
                        static_cast<double>(width) >= min_size};
        if (level.halves_y && level.halves_x) {
            level.halves_y = pitch_y <= std::numbers::sqrt2 * pitch_x;
            level.halves_x = pitch_x <= std::numbers::sqrt2 * pitch_y;
        }
        level.near_radius = near * std::max(level.halves_y ? pitch_y : 0.0, level.halves_x ? pitch_x : 0.0);
        levels.push_back(level);
        if (!level.halves_y && !level.halves_x)
            return levels;
        // Add a point before the first and one or two after the last: cubic interpolation needs four points.
        if (level.halves_y) {
            height = height / 2 + 3;
            pitch_y *= 2.0;
        }
        if (level.halves_x) {
            width = width / 2 + 3;
            pitch_x *= 2.0;
        }
    }
}

void KernelIntegrals::Points::copy(std::size_t to, const Points& from, std::size_t at)
{
    for (std::size_t m = 0; m < integrals.harmonics; ++m) {
        integrals.cosine[m * height * width + to] = from.integrals.cosine[m * from.height * from.width + at];
        integrals.sine[m * height * width + to] = from.integrals.sine[m * from.height * from.width + at];
    }
}

void KernelIntegrals::Points::mirror(std::size_t to, std::size_t from)
{
    // phi becomes pi / 2 - phi.
    for (std::size_t m = 0; m < integrals.harmonics; ++m) {
        const std::size_t first = m * height * width;
        double cosine = integrals.cosine[first + from];
        double sine = integrals.sine[first + from];
        if (m % 2 == 1)
            std::swap(cosine, sine);
        integrals.cosine[first + to] = m % 4 >= 2 ? -cosine : cosine;
        integrals.sine[first + to] = m % 4 == 0 || m % 4 == 3 ? -sine : sine;
    }
}

std::shared_ptr<const KernelIntegrals::Points> KernelIntegrals::find(const GridLevel& texels, const GridLevel& level,
                                                                     std::size_t height, std::size_t width)
{
    std::shared_ptr<const Points>& known = m_points[{level.pitch_y, level.pitch_x}];
    if (known && known->height >= height && known->width >= width)
        return known;
    if (known) {
        height = std::max(height, known->height);
        width = std::max(width, known->width);
    }
    const double x0 = -0.5 * texels.pitch_x;
    const double y0 = -0.5 * texels.pitch_y;
    // On their own grid texels share borders.
    if (level.pitch_x == texels.pitch_x && level.pitch_y == texels.pitch_y) {
        known = std::make_shared<const Points>(
            height, width, integrate_texels(m_profile, {x0, y0, texels.pitch_x, texels.pitch_y, width, height}));
        return known;
    }
    Points points{height, width, TexelIntegrals(m_profile.harmonics(), height * width)};
    const auto is_known = [&](std::size_t row, std::size_t column) {
        return known && row < known->height && column < known->width;
    };
    const bool is_square = level.pitch_x == level.pitch_y && texels.pitch_x == texels.pitch_y;
    const auto is_mirrored = [&](std::size_t row, std::size_t column) {
        return is_square && row > column && row < width;
    };
    parallel_for(height * width, [&](std::size_t at) {
        const std::size_t row = at / width;
        const std::size_t column = at - row * width;
        if (is_known(row, column)) {
            points.copy(at, *known, row * known->width + column);
        } else if (!is_mirrored(row, column)) {
            const double x = x0 + static_cast<double>(column) * level.pitch_x;
            const double y = y0 + static_cast<double>(row) * level.pitch_y;
            const TexelGrid texel{x, y, texels.pitch_x, texels.pitch_y, 1, 1};
            points.copy(at, {1, 1, integrate_texels(m_profile, texel)}, 0);
        }
    });
    for (std::size_t row = 0; row < height; ++row)
        for (std::size_t column = 0; column < width; ++column)
            if (!is_known(row, column) && is_mirrored(row, column))
                points.mirror(row * width + column, column * width + row);
    known = std::make_shared<const Points>(std::move(points));
    return known;
}

MultilevelKernel::MultilevelKernel(KernelIntegrals& integrals, const std::vector<GridLevel>& levels, LitTexels lit)
{
    // On coarser grids a texel's light lies on points up to 3 beside it.
    constexpr std::size_t margin = 5;
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const GridLevel& level = levels[k];
        const bool last = k + 1 == levels.size();
        const auto points = [&](std::size_t size, double pitch) {
            const std::size_t farthest = lit == LitTexels::middle ? std::min(size, size / 2 + margin) : size;
            return last ? farthest : std::min(size, static_cast<std::size_t>(std::ceil(level.near_radius / pitch)) + 1);
        };
        Quadrant quadrant{points(level.height, level.pitch_y), points(level.width, level.pitch_x), {}, {}};
        quadrant.points = integrals.find(levels.front(), level, quadrant.height, quadrant.width);
        for (std::size_t i = 0; i < quadrant.height; ++i)
            for (std::size_t j = 0; j < quadrant.width; ++j) {
                const double r =
                    std::hypot(static_cast<double>(i) * level.pitch_y, static_cast<double>(j) * level.pitch_x);
                double weight = last ? 1.0 : 1.0 - window(r / level.near_radius);
                for (std::size_t finer = 0; finer < k; ++finer)
                    weight *= window(r / levels[finer].near_radius);
                quadrant.window.push_back(weight);
            }
        m_levels.push_back(std::move(quadrant));
    }
}

std::vector<KernelTable> MultilevelKernel::tables(const HarmonicSum& harmonics) const
{
    std::vector<std::size_t> present;  // several for light of one direction alone
    for (std::size_t m = 0; m < m_levels.front().points->integrals.harmonics; ++m)
        if (harmonics.cosine[m] != 0.0 || harmonics.sine[m] != 0.0)
            present.push_back(m);
    std::vector<KernelTable> tables;
    for (const Quadrant& level : m_levels) {
        KernelTable& table = tables.emplace_back(level.height - 1, level.width - 1);
        const TexelIntegrals& integrals = level.points->integrals;
        const std::size_t points = level.points->height * level.points->width;
        parallel_for(level.height, [&](std::size_t i) {
            const auto dy = static_cast<std::ptrdiff_t>(i);
            for (std::size_t j = 0; j < level.width; ++j) {
                // Sum by the parity of m, for the symmetries phi -> -phi (dy < 0) and phi -> pi - phi (dx < 0).
                std::array<double, 2> cosine{};
                std::array<double, 2> sine{};
                const double weight = level.window[i * level.width + j];
                const std::size_t point = i * level.points->width + j;
                for (const std::size_t m : present) {
                    cosine[m % 2] += weight * harmonics.cosine[m] * integrals.cosine[m * points + point];
                    sine[m % 2] += weight * harmonics.sine[m] * integrals.sine[m * points + point];
                }
                const auto dx = static_cast<std::ptrdiff_t>(j);
                table.row(dy)[dx] = cosine[0] + cosine[1] + sine[0] + sine[1];
                table.row(dy)[-dx] = cosine[0] - cosine[1] - sine[0] + sine[1];
                table.row(-dy)[dx] = cosine[0] + cosine[1] - sine[0] - sine[1];
                table.row(-dy)[-dx] = cosine[0] - cosine[1] + sine[0] - sine[1];
            }
        });
    }
    return tables;
}

}  // namespace beamspread
