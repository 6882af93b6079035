#include "solve/present_angles.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/constants.h"

namespace beamspread {

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

    std::array<double, bins> light{};
    std::array<double, bins> texels{};
    const double width = std::max(last - first, 1e-12) / static_cast<double>(bins);
    for (std::size_t i = 0; i < AngleCounts::bins; ++i) {
        const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(AngleCounts::bins);
        const double place = std::clamp((middle - first) / width, 0.0, static_cast<double>(bins - 1));
        const AngleCounts::Bin& bin = counts.bin(i);
        light[static_cast<std::size_t>(place)] += bin.light;
        texels[static_cast<std::size_t>(place)] += bin.texels;
    }
    const double all_light = std::accumulate(light.begin(), light.end(), 0.0);
    const double all_texels = std::accumulate(texels.begin(), texels.end(), 0.0);
    const auto occupied = std::count_if(texels.begin(), texels.end(), [](double x) { return x > 0.0; });
    for (std::size_t i = 0; i < bins; ++i)
        if (texels[i] > 0.0)
            share[i] = (light[i] / all_light + texels[i] / all_texels + 1.0 / static_cast<double>(occupied)) / 3.0;
}

}  // namespace beamspread
