#include "solve/adaptive/tried_radius.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <numeric>

#include "base/constants.h"
#include "base/random.h"
#include "solve/adaptive/near_radius.h"
#include "solve/adaptive/term_sums.h"
#include "solve/adaptive/wide_beams.h"

namespace beamspread {

namespace {

// Radii that are tried and the one that they are compared with, of the bound. The work is as the square: compared with
// the bound itself the same ones come out, trying takes 1.35 times as long.
constexpr std::array<double, 3> parts = {0.2, 0.3, 0.44};
constexpr double compared_with = 0.66;

// Blocks of texels that are looked at, one in each of 3 x 3 parts of the plane, and some around the brightest texel, at
// distances 0, 4, 16, 64 and 256: with 4 x 4 and 8, the same radii come out in 1.1 times the time.
constexpr std::size_t strata = 3;
constexpr std::size_t around = 5;

// Lit texels from which on it is worth trying: a lamp over 128 x 128 took as long by the bound, within a fifth; over
// 256 x 256 it takes .55 to .8 of the time.
constexpr std::size_t least_lit = 32768;

// Errors in the dark are compared with so much of the mean radiance: a texel far in the dark half of a plane is off by .7
// of the tolerance, as by the bound; with .1 by 4.5 times the tolerance, in .65 of the time.
constexpr double least_radiance = 0.003;

struct Block {
    std::size_t y;  // of its first texel
    std::size_t x;
    auto operator<=>(const Block&) const = default;
};

std::vector<Block> blocks(const PlaneLight& light, const Plane& plane)
{
    Random random(0, plane.height, plane.width);
    std::vector<Block> found;
    const auto add = [&](double y, double x) {
        const auto within = [](double at, std::size_t size) {
            return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(size) - 1.0));
        };
        const std::size_t column = within(x, plane.width);
        const std::size_t row = within(y, plane.height);
        found.push_back({row - row % rows_at_once, column - column % targets_at_once});
    };
    for (std::size_t row = 0; row < strata; ++row)
        for (std::size_t column = 0; column < strata; ++column) {
            const double y = (static_cast<double>(row) + random.uniform()) / strata;
            const double x = (static_cast<double>(column) + random.uniform()) / strata;
            add(y * static_cast<double>(plane.height), x * static_cast<double>(plane.width));
        }
    std::size_t brightest = 0;
    const auto irradiance = [&](std::size_t i) { return light.irradiance(i / plane.width, i % plane.width); };
    for (std::size_t i = 0; i < plane.height * plane.width; ++i)
        if (irradiance(i) > irradiance(brightest))
            brightest = i;
    const std::size_t y = brightest / plane.width;
    const std::size_t x = brightest % plane.width;
    for (std::size_t i = 0; i < around; ++i) {
        const double r = i == 0 ? 0.0 : std::pow(4.0, static_cast<double>(i));
        const double phi = 2.0 * pi * random.uniform();
        add(static_cast<double>(y) + r * std::sin(phi), static_cast<double>(x) + r * std::cos(phi));
    }
    return found;
}

}  // namespace

double tried_radius(const LightTerms& terms, const PlaneLight& light, const std::vector<Square>& squares,
                    const std::vector<Square>& wide, double pitch_y, double pitch_x, double bound, double allowed,
                    Progress& progress)
{
    const std::size_t height = terms.plane.height;
    const std::size_t width = terms.plane.width;
    const auto texels = [](std::size_t sum, const Square& square) { return sum + square.size * square.size; };
    const std::size_t lit = std::accumulate(squares.begin(), squares.end(), std::size_t{0}, texels) -
                            std::accumulate(wide.begin(), wide.end(), std::size_t{0}, texels);
    std::vector<double> radii;
    for (const double part : parts)
        if (part * bound >= least_near_radius)
            radii.push_back(part * bound);
    if (radii.empty() || lit < least_lit)
        return bound;
    radii.push_back(compared_with * bound);
    const std::vector<Block> looked_at = blocks(light, terms.plane);
    Targets targets(height, width);
    for (const Block& block : looked_at)
        targets.add(block.y, block.x);
    std::vector<Block> summed = looked_at;  // each once
    std::ranges::sort(summed);
    summed.erase(std::ranges::unique(summed).begin(), summed.end());

    std::vector<TermSums> sums;
    for (const double radius : radii)
        sums.emplace_back(terms, grid_levels(height, width, pitch_y, pitch_x, radius));
    std::vector<Grid> radiance(radii.size(), Grid(height, width));
    for (std::size_t t = 0; t < terms.terms.size(); ++t) {
        Grid beams = term_light(terms, t);
        take_steps(beams, wide);
        for (std::size_t i = 0; i < radii.size(); ++i) {
            const Grid part = sums[i].sum(t, beams, progress, 0.0, &targets);
            for (const Block& block : summed)
                for (std::size_t y = block.y; y < std::min(height, block.y + rows_at_once); ++y)
                    for (std::size_t x = block.x; x < std::min(width, block.x + targets_at_once); ++x)
                        radiance[i].row(y)[x] += part.row(y)[x];
        }
        progress.advance(0.0);
    }

    const auto mean = [&](const Block& block, auto value) {
        const std::size_t end_y = std::min(height, block.y + rows_at_once);
        const std::size_t end_x = std::min(width, block.x + targets_at_once);
        double sum = 0.0;
        for (std::size_t y = block.y; y < end_y; ++y)
            for (std::size_t x = block.x; x < end_x; ++x)
                sum += std::abs(value(y, x));
        return sum / static_cast<double>((end_y - block.y) * (end_x - block.x));
    };
    const auto exact = [&](std::size_t y, std::size_t x) { return radiance.back().row(y)[x]; };
    double everywhere = 0.0;
    for (std::size_t i = 0; i < strata * strata; ++i)
        everywhere += mean(looked_at[i], exact) / (strata * strata);
    for (std::size_t i = 0; i + 1 < radii.size(); ++i) {
        double most = 0.0;
        for (const Block& block : looked_at) {
            const double error = mean(
                block, [&](std::size_t y, std::size_t x) { return radiance[i].row(y)[x] - radiance.back().row(y)[x]; });
            most = std::max(most, error / std::max(mean(block, exact), least_radiance * everywhere));
        }
        if (most <= allowed)
            return radii[i];
    }
    return bound;
}

}  // namespace beamspread
