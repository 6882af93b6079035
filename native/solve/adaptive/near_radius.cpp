#include "solve/adaptive/near_radius.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/constants.h"

namespace beamspread {

namespace {

double kernel_at(const SpreadLight& light, double x, double y)
{
    const double r = std::hypot(x, y);
    const Harmonics density = light.profile->density(r);
    double cosine = 1.0;  // cos(m phi), sin(m phi)
    double sine = 0.0;
    double sum = 0.0;
    for (std::size_t m = 0; m < light.profile->harmonics(); ++m) {
        sum += density[m] * (light.kernel.cosine[m] * cosine + light.kernel.sine[m] * sine);
        const double next = (cosine * x - sine * y) / r;
        sine = (sine * x + cosine * y) / r;
        cosine = next;
    }
    return sum;
}

// The sum of absolute errors for a beam of unit power: of the kernel against its interpolation from points as far apart
// as those through which it is seen at that distance. Most comes from the noise of simulated profiles, whose cubics meet
// four times an octave, so that no formula gives it.
double interpolation_error(const SpreadLight& light, double near, double first, double last)
{
    // Half the distance between the points, over distance / near: where the window has risen to a half, at .6 of the
    // near radius.
    constexpr double spacing = 1.0 / 0.6;
    // Two rings per octave and more than two directions per wave of the last harmonic.
    const int rings = static_cast<int>(std::ceil(2.0 * std::log2(last / first))) + 1;
    const int directions = 2 * static_cast<int>(light.profile->harmonics()) + 3;
    const double log_step = std::log(last / first) / rings;
    double sum = 0.0;
    for (int i = 0; i < rings; ++i) {
        const double r = first * std::exp((i + 0.5) * log_step);
        const double step = spacing * r / near;
        for (int j = 0; j < directions; ++j) {
            const double phi = 2.0 * pi * j / directions;
            const double x = r * std::cos(phi);
            const double y = r * std::sin(phi);
            const double exact = kernel_at(light, x, y);
            const auto error = [&](double dx, double dy) {
                const auto pair = [&](double k) {
                    return kernel_at(light, x + k * dx, y + k * dy) + kernel_at(light, x - k * dx, y - k * dy);
                };
                return std::abs((9.0 * pair(1.0) - pair(3.0)) / 16.0 - exact);
            };
            // Of the place that light comes from and of the one that it gets to.
            sum += 2.0 * (error(step, 0.0) + error(0.0, step)) * r * r;
        }
    }
    return sum * log_step * 2.0 * pi / directions;
}

}  // namespace

double near_radius(const std::vector<SpreadLight>& lights, double pitch, double distance, double allowed,
                   Progress& progress)
{
    // Below, the window's own shape is too much for the interpolation.
    constexpr double least = 8.0;
    double power = 0.0;
    for (const SpreadLight& light : lights)
        power += light.sum * light.kernel.cosine[0] * 2.0 * pi * light.profile->cumulative(distance)[0];
    const auto expected = [&](double near) {
        const double first = 0.5 * near * pitch;
        if (first >= distance)
            return 0.0;
        // The errors of many kernels have nothing to do with each other: their squares add up.
        double squares = 0.0;
        for (const SpreadLight& light : lights) {
            const double error = light.absolute_sum * interpolation_error(light, near, first, distance);
            squares += error * error;
            progress.advance(0.0);
        }
        return std::sqrt(squares);
    };
    double near = least;
    while (expected(near) > allowed * std::max(power, 0.0))
        near *= std::numbers::sqrt2;
    return near;
}

}  // namespace beamspread
