#include "solve/separable/low_rank.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <variant>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Number of the histogram's bins, for tan(theta / 2) from 0 to 1. More: fewer terms, more memory.
constexpr std::size_t bin_count = 2048;
constexpr std::size_t rows_per_item = 16;

// Largest tan(theta / 2): 90 degrees, after rounding, is no angle of incidence.
constexpr double max_angle = 1.0 - 1e-6;

struct Histogram {
    std::vector<double> light = std::vector<double>(bin_count);
    std::vector<double> beams = std::vector<double>(bin_count);
    std::vector<Incidence::Extremes> extremes;
};

void merge(const Incidence::Extremes& from, Incidence::Extremes& to)
{
    if (from.irradiance > to.irradiance) {
        to.irradiance = from.irradiance;
        to.brightest = from.brightest;
    }
    if (from.min_angle < to.min_angle) {
        to.min_angle = from.min_angle;
        to.steepest = from.steepest;
    }
    if (from.max_angle > to.max_angle) {
        to.max_angle = from.max_angle;
        to.most_grazing = from.most_grazing;
    }
}

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
        merge({{y, x}, {y, x}, {y, x}, power, angle, angle}, extremes);
    }
}

Histogram histogram_of(const Plane& plane, const std::vector<PlaneLight>& lights)
{
    Histogram sum;
    sum.extremes.resize(lights.size());
    const auto read_rows = [&](std::size_t item) {
        Histogram part;
        part.extremes.resize(lights.size());
        BeamRow row;
        for (std::size_t l = 0; l < lights.size(); ++l) {
            const double strength = std::accumulate(lights[l].color.begin(), lights[l].color.end(), 0.0);
            const std::size_t end = std::min(plane.height, (item + 1) * rows_per_item);
            for (std::size_t y = item * rows_per_item; y < end && strength > 0.0; ++y)
                if (row.read(plane, lights[l], {y, 0, plane.width}))
                    add_row(row, y, strength, part, part.extremes[l]);
        }
        return part;
    };
    parallel_ordered((plane.height + rows_per_item - 1) / rows_per_item, [&](std::size_t item) {
        return [&, part = read_rows(item)] {
            add_scaled(sum.light.data(), part.light.data(), 1.0, bin_count);
            add_scaled(sum.beams.data(), part.beams.data(), 1.0, bin_count);
            for (std::size_t l = 0; l < lights.size(); ++l)
                merge(part.extremes[l], sum.extremes[l]);
        };
    });
    return sum;
}

// Largest step between the angles of lit neighbours in a lamp's survey: texels between them differ by less. Rays of
// lights with a size are random and need no margin.
double max_step(const ComingLight& coming)
{
    float step = 0.0f;
    for (const auto& [plane, texels_each, light] : coming.survey) {
        if (!std::holds_alternative<FromPoint>(light.directions))
            continue;
        const std::size_t width = plane.width;
        BeamRow row;
        BeamRow below;  // the previous row
        for (std::size_t y = 0; y < plane.height; ++y) {
            std::swap(row, below);
            if (!row.read(plane, light, {y, 0, width})) {
                row.irradiance.assign(width, 0.0f);
                continue;
            }
            for (std::size_t x = 0; x < width; ++x) {
                if (row.irradiance[x] == 0.0f)
                    continue;
                if (x > 0 && row.irradiance[x - 1] > 0.0f)
                    step = std::max(step, std::abs(row.half_tangent[x] - row.half_tangent[x - 1]));
                if (y > 0 && below.irradiance[x] > 0.0f)
                    step = std::max(step, std::abs(row.half_tangent[x] - below.half_tangent[x]));
            }
        }
    }
    return static_cast<double>(step);
}

// Weights of four neighbours at t in [0, 1] between the second and the third, by a cubic B-spline (de
// Boor 2001, "A Practical Guide to Splines", Ch. IX).
std::array<double, 4> cubic_b_spline(double t)
{
    const double s = 1.0 - t;
    return {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0, (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
            t * t * t / 6.0};
}

}  // namespace

Incidence::Incidence(const Plane& plane, const std::vector<PlaneLight>& lights, const ComingLight& coming)
{
    Histogram histogram = histogram_of(plane, lights);
    extremes = histogram.extremes;
    extend(extremes, 0.0);
    const double margin = max_step(coming);
    for (const SurveyedLight& surveyed : coming.survey) {
        const Histogram later = histogram_of(surveyed.plane, {surveyed.light});
        add_scaled(histogram.light.data(), later.light.data(), surveyed.texels_each, bin_count);
        add_scaled(histogram.beams.data(), later.beams.data(), surveyed.texels_each, bin_count);
        extend(later.extremes, margin);
    }
    if (none())
        return;

    std::array<double, count> light{};
    std::array<double, count> beams{};
    const double step = std::max(last - first, 1e-12) / static_cast<double>(count - 1);
    for (std::size_t i = 0; i < bin_count; ++i) {
        if (histogram.beams[i] == 0.0)
            continue;
        const double middle = (static_cast<double>(i) + 0.5) / static_cast<double>(bin_count);
        const double position = std::clamp((middle - first) / step, 0.0, static_cast<double>(count - 1));
        const double below = std::min(std::floor(position), static_cast<double>(count - 2));
        const std::array<double, 4> weights = cubic_b_spline(position - below);
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

void Incidence::extend(const std::vector<Extremes>& lights, double margin)
{
    for (const Extremes& light : lights) {
        if (light.irradiance == 0.0)
            continue;
        first = std::min(first, std::max(static_cast<double>(light.min_angle) - margin, 0.0));
        last = std::max(last, static_cast<double>(light.max_angle) + margin);
    }
    last = std::min(last, max_angle);
}

}  // namespace beamspread
