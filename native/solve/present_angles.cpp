#include "solve/present_angles.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// Fine bins of half_tangent from 0 to 1, and rows that are counted together.
constexpr std::size_t fine_bins = 2048;
constexpr std::size_t rows_per_item = 32;

struct AngleCounts {
    float first = 1.0f;
    float last = 0.0f;
    std::vector<double> light = std::vector<double>(fine_bins, 0.0);
    std::vector<double> texels = std::vector<double>(fine_bins, 0.0);
};

AngleCounts count_angles(const LightField& light, std::size_t first_row, std::size_t last_row)
{
    AngleCounts counts;
    const std::size_t width = light.irradiance.width;
    std::vector<float> irradiance(width);
    std::vector<float> cosine(width);
    std::vector<float> sine(width);
    std::vector<float> place(width);
    for (std::size_t y = first_row; y < last_row; ++y) {
        for (std::size_t x = 0; x < width; ++x)
            irradiance[x] = light.irradiance(y, x);
        find_angles(light.directions.field + 3 * y * width, irradiance.data(), cosine.data(), sine.data(), place.data(),
                    width);
        for (std::size_t x = 0; x < width; ++x) {
            if (irradiance[x] == 0.0f)
                continue;
            counts.first = std::min(counts.first, place[x]);
            counts.last = std::max(counts.last, place[x]);
            const auto bin =
                std::min(static_cast<std::size_t>(place[x] * static_cast<float>(fine_bins)), fine_bins - 1);
            counts.light[bin] += static_cast<double>(irradiance[x]);
            counts.texels[bin] += 1.0;
        }
    }
    return counts;
}

}  // namespace

double angle_deg(double half_tangent)
{
    return 2.0 * std::atan(half_tangent) / radians_per_degree;
}

PresentAngles::PresentAngles(const std::vector<LightField>& lights)
{
    AngleCounts counted;
    const std::size_t height = lights.front().irradiance.height;
    for (const LightField& light : lights) {
        parallel_ordered<AngleCounts>((height + rows_per_item - 1) / rows_per_item,
                                      [&](std::size_t item) {
                                          return count_angles(light, item * rows_per_item,
                                                              std::min(height, (item + 1) * rows_per_item));
                                      },
                                      [&](std::size_t, const AngleCounts& rows) {
                                          counted.first = std::min(counted.first, rows.first);
                                          counted.last = std::max(counted.last, rows.last);
                                          for (std::size_t i = 0; i < fine_bins; ++i) {
                                              counted.light[i] += rows.light[i];
                                              counted.texels[i] += rows.texels[i];
                                          }
                                      });
    }
    first = static_cast<double>(counted.first);
    // Rounded up to 90 degrees exactly, an angle would be no angle of incidence.
    last = std::min(static_cast<double>(counted.last), 1.0 - 1e-6);
    if (none())
        return;

    std::array<double, bins> light{};
    std::array<double, bins> texels{};
    const double width = std::max(last - first, 1e-12) / static_cast<double>(bins);
    for (std::size_t i = 0; i < fine_bins; ++i) {
        const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(fine_bins);
        const double place = std::clamp((middle - first) / width, 0.0, static_cast<double>(bins - 1));
        light[static_cast<std::size_t>(place)] += counted.light[i];
        texels[static_cast<std::size_t>(place)] += counted.texels[i];
    }
    const double all_light = std::accumulate(light.begin(), light.end(), 0.0);
    const double all_texels = std::accumulate(texels.begin(), texels.end(), 0.0);
    const auto occupied = std::count_if(texels.begin(), texels.end(), [](double x) { return x > 0.0; });
    for (std::size_t i = 0; i < bins; ++i)
        if (texels[i] > 0.0)
            share[i] = (light[i] / all_light + texels[i] / all_texels + 1.0 / static_cast<double>(occupied)) / 3.0;
}

}  // namespace beamspread
