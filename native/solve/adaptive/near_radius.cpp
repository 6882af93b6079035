#include "solve/adaptive/near_radius.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/constants.h"
#include "base/random.h"
#include "base/vec.h"
#include "simd/loops.h"
#include "solve/adaptive/term_sums.h"
#include "solve/adaptive/wide_beams.h"

namespace beamspread {

namespace {

// Below, in points of a grid, the window's own shape is too much for the interpolation. Errors with 4 and 16 differ by
// no more than 2e-5 of the light, the time by 10 %.
constexpr double least_near_radius = 8.0;

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

double kernel_at(const RadialProfile& profile, const Vec2& place)
{
    const double r = glm::length(place);
    const Harmonics density = profile.density(r);
    const Vec2 turn = place / r;
    Vec2 multiple(1.0, 0.0);  // cos(m phi), sin(m phi)
    double sum = 0.0;
    for (std::size_t m = 0; m < profile.harmonics(); ++m) {
        sum += density[m] * multiple.x;
        multiple = {multiple.x * turn.x - multiple.y * turn.y, multiple.x * turn.y + multiple.y * turn.x};
    }
    return sum;
}

// The sum of absolute errors for a beam of unit power: of the kernel against its interpolation from points as far apart
// as those through which it is seen at that distance, on a grid turned by `axis` against the beam. Most comes from the
// noise of simulated profiles, whose cubics meet four times an octave, so that no formula gives it.
double interpolation_error(const RadialProfile& profile, const Vec2& axis, double near, double first, double last)
{
    // Half the distance between the points, over distance / near: where the window has risen to a half, at .6 of the
    // near radius. Half of it, a sun around a hole is off by ten times as much in .6 of the time; twice by a tenth in 1.9
    // times.
    constexpr double spacing = 1.0 / 0.6;
    // Two rings per octave and more than two directions per wave of the last harmonic: with half and with
    // twice as many of either, results are the same to two digits of their errors.
    const int rings = static_cast<int>(std::ceil(2.0 * std::log2(last / first))) + 1;
    const int directions = 2 * static_cast<int>(profile.harmonics()) + 3;
    const double log_step = std::log(last / first) / rings;
    double sum = 0.0;
    for (int i = 0; i < rings; ++i) {
        const double r = first * std::exp((i + 0.5) * log_step);
        const double step = spacing * r / near;
        for (int j = 0; j < directions; ++j) {
            const double phi = 2.0 * pi * j / directions;
            const Vec2 place(r * std::cos(phi), r * std::sin(phi));
            const double exact = kernel_at(profile, place);
            const auto error = [&](const Vec2& by) {
                const auto pair = [&](double k) {
                    return kernel_at(profile, place + k * by) + kernel_at(profile, place - k * by);
                };
                return std::abs((9.0 * pair(1.0) - pair(3.0)) / 16.0 - exact);
            };
            // Of the place that light comes from and of the one that it gets to.
            sum += 2.0 * (error(step * axis) + error(step * Vec2(-axis.y, axis.x))) * r * r;
        }
    }
    return sum * log_step * 2.0 * pi / directions;
}

// Their first texels.
std::vector<Texel> blocks(const PlaneLight& light, const Plane& plane)
{
    Random random(0, plane.height, plane.width);
    std::vector<Texel> found;
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
    const auto [y, x] = brightest(light.irradiance);
    for (std::size_t i = 0; i < around; ++i) {
        const double r = i == 0 ? 0.0 : std::pow(4.0, static_cast<double>(i));
        const double phi = 2.0 * pi * random.uniform();
        add(static_cast<double>(y) + r * std::sin(phi), static_cast<double>(x) + r * std::cos(phi));
    }
    return found;
}

}  // namespace

double near_radius(const std::vector<AngleLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress)
{
    double power = 0.0;
    for (const AngleLight& light : lights)
        power += light.power * 2.0 * pi * light.profile.cumulative(distance)[0];
    const auto largest = [&](double near) {
        const double first = 0.5 * near * pitch;
        if (first >= distance)
            return 0.0;
        double sum = 0.0;
        for (const AngleLight& light : lights) {
            const auto error = [&](const Vec2& axis) {
                return interpolation_error(light.profile, axis, near, first, distance);
            };
            sum += light.power * std::max(error({1.0, 0.0}), error({std::sqrt(0.5), std::sqrt(0.5)}));
            progress.advance(0.0);
        }
        return sum;
    };
    // The work is as the square: 1.1 and 1.44 change it by about 10 %, errors by less than 3e-5 of the light.
    constexpr double finer = 1.2;
    double near = least_near_radius;
    while (largest(near) > allowed * std::max(power, 0.0))
        near *= finer;
    return near;
}

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
    const std::vector<Texel> looked_at = blocks(light, terms.plane);
    Targets targets(height, width);
    for (const Texel& block : looked_at)
        targets.add(block.y, block.x);

    std::vector<TermSums> sums;
    for (const double radius : radii)
        sums.emplace_back(terms, grid_levels(height, width, pitch_y, pitch_x, radius));
    std::vector<Grid> radiance(radii.size(), Grid(height, width));
    for (std::size_t t = 0; t < terms.terms.size(); ++t) {
        Grid beams = term_light(terms, t);
        take_steps(beams, wide);
        for (std::size_t i = 0; i < radii.size(); ++i) {
            const Grid part = sums[i].sum(t, beams, progress, 0.0, &targets);
            add_scaled(radiance[i].values.data(), part.values.data(), 1.0, part.values.size());
        }
        progress.advance(0.0);
    }

    const auto mean = [&](const Texel& block, auto value) {
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
        for (const Texel& block : looked_at) {
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
