#include "solve/adaptive/adaptive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/constants.h"
#include "base/random.h"
#include "base/vec.h"
#include "simd/loops.h"
#include "solve/adaptive/multilevel_sum.h"

namespace beamspread {

namespace {

// Smallest near radius, in points of a grid; with smaller ones the interpolation does not resolve the window. Larger:
// smaller errors, more time.
constexpr double min_near_radius = 8.0;

// Tried radii, and the radius that they are compared with, over the bound. The work grows with the square.
constexpr std::array<double, 3> trial_radii = {0.2, 0.3, 0.44};
constexpr double reference_radius = 0.66;

// Probed blocks of texels: one in each of strata x strata parts of the plane, and some around the brightest texel, at
// distances 0, 4, 16, 64 and 256. More: a safer choice, more time.
constexpr std::size_t strata = 3;
constexpr std::size_t around = 5;

// Number of lit texels from which trials save time.
constexpr std::size_t min_lit = 32768;

// Smallest radiance that errors are compared with, over the mean. Larger: larger errors in the dark, less time.
constexpr double min_radiance = 0.003;

double kernel_at(const RadialProfile& profile, const Vec2& point)
{
    const double r = glm::length(point);
    const Harmonics density = profile.density(r);
    const Vec2 turn = point / r;
    Vec2 multiple(1.0, 0.0);  // cos(m phi), sin(m phi)
    double sum = 0.0;
    for (std::size_t m = 0; m < profile.harmonics(); ++m) {
        sum += density[m] * multiple.x;
        multiple = {multiple.x * turn.x - multiple.y * turn.y, multiple.x * turn.y + multiple.y * turn.x};
    }
    return sum;
}

// Sum of absolute errors for a beam of unit power: of the kernel against its interpolation from points of the spacing
// of the grid at that distance, along `axis` relative to the beam. Most of it is noise of simulated profiles, for which
// there is no formula. Infinite if it is more than `most`, which ends it early.
double interpolation_error(const RadialProfile& profile, const Vec2& axis, double near, double first, double last,
                           double most)
{
    // Ratio: half the distance of the points, over distance / near. The window has risen to one half at .6 of the near
    // radius. Larger: smaller errors, more time.
    constexpr double spacing = 1.0 / 0.6;
    // Choose two rings per octave, and more than two directions per period of the last harmonic.
    const int rings = static_cast<int>(std::ceil(2.0 * std::log2(last / first))) + 1;
    const int directions = 2 * static_cast<int>(profile.harmonics()) + 3;
    const double log_step = std::log(last / first) / rings;
    const double scale = log_step * 2.0 * pi / directions;
    double sum = 0.0;
    for (int i = 0; i < rings && sum * scale <= most; ++i) {
        const double r = first * std::exp((i + 0.5) * log_step);
        const double step = spacing * r / near;
        for (int j = 0; j < directions; ++j) {
            const double phi = 2.0 * pi * j / directions;
            const Vec2 point(r * std::cos(phi), r * std::sin(phi));
            const double exact = kernel_at(profile, point);
            const auto error = [&](const Vec2& by) {
                const auto pair = [&](double k) {
                    return kernel_at(profile, point + k * by) + kernel_at(profile, point - k * by);
                };
                return std::abs((9.0 * pair(1.0) - pair(3.0)) / 16.0 - exact);
            };
            // Count the error twice: for the point of entry and the point of exit.
            sum += 2.0 * (error(step * axis) + error(step * Vec2(-axis.y, axis.x))) * r * r;
        }
    }
    return sum * scale <= most ? sum * scale : std::numeric_limits<double>::infinity();
}

// First texels of the probed blocks.
std::vector<Texel> probed_blocks(const PlaneLight& light, const Plane& plane)
{
    Random random(0, plane.height, plane.width);
    std::vector<Texel> blocks;
    const auto add = [&](double y, double x) {
        const auto within = [](double at, std::size_t size) {
            return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(size) - 1.0));
        };
        const std::size_t column = within(x, plane.width);
        const std::size_t row = within(y, plane.height);
        blocks.push_back({row - row % rows_at_once, column - column % targets_at_once});
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
    return blocks;
}

}  // namespace

double near_radius(const std::vector<AngleLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress)
{
    double power = 0.0;
    for (const AngleLight& light : lights)
        power += light.power * 2.0 * pi * light.profile.cumulative(distance)[0];
    const double most = allowed * std::max(power, 0.0);
    // Infinite if more than `most`.
    const auto error_bound = [&](double near) {
        const double first = 0.5 * near * pitch;
        if (first >= distance)
            return 0.0;
        double sum = 0.0;
        for (const AngleLight& light : lights) {
            const double left = (most - sum) / light.power;
            double error = 0.0;
            for (const Vec2& axis : {Vec2(1.0, 0.0), Vec2(std::sqrt(0.5), std::sqrt(0.5))})
                if (error <= left)
                    error = std::max(error, interpolation_error(light.profile, axis, near, first, distance, left));
            sum += light.power * error;
            progress.advance(0.0);
            if (sum > most)
                break;
        }
        return sum;
    };
    constexpr double growth = 1.2;  // of tried radii; larger: larger radii, less time for the search
    double near = min_near_radius;
    while (error_bound(near) > most)
        near *= growth;
    return near;
}

double tried_radius(const LightTerms& terms, std::vector<KernelIntegrals>& integrals, const PlaneLight& light,
                    const std::vector<Square>& squares, const std::vector<Square>& wide, double pitch_y, double pitch_x,
                    double bound, double allowed, Progress& progress)
{
    const std::size_t height = terms.plane.height;
    const std::size_t width = terms.plane.width;
    const auto texels = [](std::size_t sum, const Square& square) { return sum + square.size * square.size; };
    const std::size_t lit = std::accumulate(squares.begin(), squares.end(), std::size_t{0}, texels) -
                            std::accumulate(wide.begin(), wide.end(), std::size_t{0}, texels);
    std::vector<double> radii;
    for (const double radius : trial_radii)
        if (radius * bound >= min_near_radius)
            radii.push_back(radius * bound);
    if (radii.empty() || lit < min_lit)
        return bound;
    radii.push_back(reference_radius * bound);
    const std::vector<Texel> blocks = probed_blocks(light, terms.plane);
    Targets targets(height, width);
    for (const Texel& block : blocks)
        targets.add(block.y, block.x);

    std::vector<TermSums> sums;
    for (const double radius : radii)
        sums.emplace_back(terms, integrals, grid_levels(height, width, pitch_y, pitch_x, radius));
    std::vector<Grid> radiance(radii.size(), Grid(height, width));
    for (std::size_t t = 0; t < terms.terms.size(); ++t) {
        Grid beams = term_light(terms, t);
        take_steps(beams, wide);
        // The largest radius comes first: others need a part of its integrals.
        for (std::size_t i = radii.size(); i-- > 0;) {
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
        everywhere += mean(blocks[i], exact) / (strata * strata);
    for (std::size_t i = 0; i + 1 < radii.size(); ++i) {
        double max_error = 0.0;
        for (const Texel& block : blocks) {
            const double error = mean(
                block, [&](std::size_t y, std::size_t x) { return radiance[i].row(y)[x] - radiance.back().row(y)[x]; });
            max_error = std::max(max_error, error / std::max(mean(block, exact), min_radiance * everywhere));
        }
        if (max_error <= allowed)
            return radii[i];
    }
    return bound;
}

}  // namespace beamspread
