#include "solve/separable/incidence.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/constants.h"
#include "base/threads.h"

namespace beamspread {

namespace {

constexpr std::size_t bin_count = 2048;  // from 0 to 1
constexpr std::size_t rows_per_item = 16;

// Rounded up to 90 degrees exactly, an angle would be no angle of incidence.
constexpr double largest = 1.0 - 1e-6;

struct Histogram {
    std::vector<double> light = std::vector<double>(bin_count);
    std::vector<double> beams = std::vector<double>(bin_count);
    std::vector<Incidence::Extremes> extremes;
};

void add_row(const BeamRow& row, std::size_t y, double strength, Histogram& histogram, Incidence::Extremes& extremes)
{
    for (std::size_t x = 0; x < row.irradiance.size(); ++x) {
        const float irradiance = row.irradiance[x];
        if (irradiance == 0.0f)
            continue;
        const float angle = row.half_tangent[x];
        const auto bin = std::min(static_cast<std::size_t>(angle * static_cast<float>(bin_count)), bin_count - 1);
        const double power = strength * static_cast<double>(irradiance);
        histogram.light[bin] += power;
        histogram.beams[bin] += 1.0;
        if (power > extremes.irradiance) {
            extremes.irradiance = power;
            extremes.brightest = {y, x};
        }
        if (angle < extremes.least) {
            extremes.least = angle;
            extremes.steepest = {y, x};
        }
        if (angle > extremes.greatest) {
            extremes.greatest = angle;
            extremes.most_grazing = {y, x};
        }
    }
}

void merge(const Incidence::Extremes& from, Incidence::Extremes& to)
{
    if (from.irradiance > to.irradiance) {
        to.irradiance = from.irradiance;
        to.brightest = from.brightest;
    }
    if (from.least < to.least) {
        to.least = from.least;
        to.steepest = from.steepest;
    }
    if (from.greatest > to.greatest) {
        to.greatest = from.greatest;
        to.most_grazing = from.most_grazing;
    }
}

Histogram histogram_of(const Plane& plane, const std::vector<PlaneLight>& lights)
{
    Histogram sum;
    sum.extremes.resize(lights.size());
    parallel_ordered<Histogram>((plane.height + rows_per_item - 1) / rows_per_item,
                                [&](std::size_t item) {
                                    Histogram part;
                                    part.extremes.resize(lights.size());
                                    BeamRow row;
                                    for (std::size_t l = 0; l < lights.size(); ++l) {
                                        const double strength =
                                            std::accumulate(lights[l].color.begin(), lights[l].color.end(), 0.0);
                                        const std::size_t end = std::min(plane.height, (item + 1) * rows_per_item);
                                        for (std::size_t y = item * rows_per_item; y < end && strength > 0.0; ++y)
                                            if (row.read(plane, lights[l], {y, 0, plane.width}))
                                                add_row(row, y, strength, part, part.extremes[l]);
                                    }
                                    return part;
                                },
                                [&](std::size_t, const Histogram& part) {
                                    for (std::size_t i = 0; i < bin_count; ++i) {
                                        sum.light[i] += part.light[i];
                                        sum.beams[i] += part.beams[i];
                                    }
                                    for (std::size_t l = 0; l < lights.size(); ++l)
                                        merge(part.extremes[l], sum.extremes[l]);
                                });
    return sum;
}

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

Incidence::Incidence(const Plane& plane, const std::vector<PlaneLight>& lights)
{
    const Histogram histogram = histogram_of(plane, lights);
    extremes = histogram.extremes;
    for (const Extremes& each : extremes) {
        first = std::min(first, static_cast<double>(each.least));
        last = std::max(last, static_cast<double>(each.greatest));
    }
    last = std::min(last, largest);
    if (none())
        return;

    std::array<double, count> light{};
    std::array<double, count> beams{};
    const double step = std::max(last - first, 1e-12) / static_cast<double>(count - 1);
    for (std::size_t i = 0; i < bin_count; ++i) {
        if (histogram.beams[i] == 0.0)
            continue;
        const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(bin_count);
        const double place = std::clamp((middle - first) / step, 0.0, static_cast<double>(count - 1));
        const double below = std::min(std::floor(place), static_cast<double>(count - 2));
        const std::array<double, 4> weights = cubic_b_spline(place - below);
        for (int k = 0; k < 4; ++k) {
            const auto node =
                static_cast<std::size_t>(std::clamp(below + k - 1.0, 0.0, static_cast<double>(count - 1)));
            light[node] += weights[static_cast<std::size_t>(k)] * histogram.light[i];
            beams[node] += weights[static_cast<std::size_t>(k)] * histogram.beams[i];
        }
    }
    const double all_light = std::accumulate(light.begin(), light.end(), 0.0);
    const double all_beams = std::accumulate(beams.begin(), beams.end(), 0.0);
    const auto occupied = std::count_if(beams.begin(), beams.end(), [](double x) { return x > 0.0; });
    for (std::size_t i = 0; i < count; ++i)
        if (beams[i] > 0.0)
            share[i] = (light[i] / all_light + beams[i] / all_beams + 1.0 / static_cast<double>(occupied)) / 3.0;
}

}  // namespace beamspread
