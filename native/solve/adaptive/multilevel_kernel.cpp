#include "solve/adaptive/multilevel_sum.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

// Integrals over texels at the points of a level's grid. On the texels' own grid they share borders.
TexelIntegrals integrate_quadrant(const RadialProfile& profile, const GridLevel& texels, const GridLevel& level,
                                  std::size_t height, std::size_t width)
{
    const double x0 = -0.5 * texels.pitch_x;
    const double y0 = -0.5 * texels.pitch_y;
    if (level.pitch_x == texels.pitch_x && level.pitch_y == texels.pitch_y)
        return integrate_texels(profile, {x0, y0, texels.pitch_x, texels.pitch_y, width, height});
    TexelIntegrals out(profile.harmonics(), height * width);
    parallel_for(height * width, [&](std::size_t at) {
        const std::size_t row = at / width;
        const double x = x0 + static_cast<double>(at - row * width) * level.pitch_x;
        const double y = y0 + static_cast<double>(row) * level.pitch_y;
        const TexelIntegrals texel = integrate_texels(profile, {x, y, texels.pitch_x, texels.pitch_y, 1, 1});
        for (std::size_t m = 0; m < out.harmonics; ++m) {
            out.cosine[m * height * width + at] = texel.cosine[m];
            out.sine[m * height * width + at] = texel.sine[m];
        }
    });
    return out;
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

MultilevelKernel::MultilevelKernel(const RadialProfile& profile, const std::vector<GridLevel>& levels)
{
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const GridLevel& level = levels[k];
        const bool last = k + 1 == levels.size();
        const auto points = [&](std::size_t size, double pitch) {
            return last ? size : std::min(size, static_cast<std::size_t>(std::ceil(level.near_radius / pitch)) + 1);
        };
        Quadrant quadrant{points(level.height, level.pitch_y), points(level.width, level.pitch_x), {}, {}};
        quadrant.integrals = integrate_quadrant(profile, levels.front(), level, quadrant.height, quadrant.width);
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
    for (std::size_t m = 0; m < m_levels.front().integrals.harmonics; ++m)
        if (harmonics.cosine[m] != 0.0 || harmonics.sine[m] != 0.0)
            present.push_back(m);
    std::vector<KernelTable> tables;
    for (const Quadrant& level : m_levels) {
        KernelTable& table = tables.emplace_back(level.height - 1, level.width - 1);
        const std::size_t points = level.height * level.width;
        parallel_for(level.height, [&](std::size_t i) {
            const auto dy = static_cast<std::ptrdiff_t>(i);
            for (std::size_t j = 0; j < level.width; ++j) {
                // Sum by the parity of m, for the symmetries phi -> -phi (dy < 0) and phi -> pi - phi (dx < 0).
                std::array<double, 2> cosine{};
                std::array<double, 2> sine{};
                const std::size_t point = i * level.width + j;
                for (const std::size_t m : present) {
                    const double weight = level.window[point];
                    cosine[m % 2] += weight * harmonics.cosine[m] * level.integrals.cosine[m * points + point];
                    sine[m % 2] += weight * harmonics.sine[m] * level.integrals.sine[m * points + point];
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
