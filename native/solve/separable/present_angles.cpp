#include "solve/separable/present_angles.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/constants.h"

namespace beamspread {

namespace {

// Of four neighbours at t in [0, 1] between the second and the third.
std::array<double, 4> cubic_b_spline(double t)
{
    const double s = 1.0 - t;
    return {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0, (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
            t * t * t / 6.0};
}

}  // namespace

double angle_deg(double half_tangent)
{
    return 2.0 * std::atan(half_tangent) / radians_per_degree;
}

PresentAngles::PresentAngles(const AngleCounts& counts) : first(static_cast<double>(counts.first()))
{
    // Rounded up to 90 degrees exactly, an angle would be no angle of incidence.
    last = std::min(static_cast<double>(counts.last()), 1.0 - 1e-6);
    if (none())
        return;

    std::array<double, count> light{};
    std::array<double, count> texels{};
    const double step = std::max(last - first, 1e-12) / static_cast<double>(count - 1);
    for (std::size_t i = 0; i < AngleCounts::bins; ++i) {
        const AngleCounts::Bin& bin = counts.bin(i);
        if (bin.texels == 0.0)
            continue;
        const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(AngleCounts::bins);
        const double place = std::clamp((middle - first) / step, 0.0, static_cast<double>(count - 1));
        const double below = std::min(std::floor(place), static_cast<double>(count - 2));
        const std::array<double, 4> weights = cubic_b_spline(place - below);
        for (int k = 0; k < 4; ++k) {
            const double node = std::clamp(below + k - 1.0, 0.0, static_cast<double>(count - 1));
            light[static_cast<std::size_t>(node)] += weights[static_cast<std::size_t>(k)] * bin.light;
            texels[static_cast<std::size_t>(node)] += weights[static_cast<std::size_t>(k)] * bin.texels;
        }
    }
    const double all_light = std::accumulate(light.begin(), light.end(), 0.0);
    const double all_texels = std::accumulate(texels.begin(), texels.end(), 0.0);
    const auto occupied = std::count_if(texels.begin(), texels.end(), [](double x) { return x > 0.0; });
    for (std::size_t i = 0; i < count; ++i)
        if (texels[i] > 0.0)
            share[i] = (light[i] / all_light + texels[i] / all_texels + 1.0 / static_cast<double>(occupied)) / 3.0;
}

}  // namespace beamspread
