#include "ldf/samples/interpolate.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "ldf/samples/ldf_sample.h"

namespace beamspread {

namespace {

// True if two values differ at most by the rounding of a file's single precision.
bool same(double a, double b)
{
    return std::abs(a - b) <= 1e-6 * std::max({1.0, std::abs(a), std::abs(b)});
}

template <class Value>
std::vector<double> axis(const std::vector<const LdfSample*>& samples, const Value& value)
{
    std::vector<double> values;
    for (const LdfSample* sample : samples)
        values.push_back(value(*sample));
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end(), same), values.end());
    return values;
}

std::string description(double angle_deg, double albedo, std::optional<double> g)
{
    std::ostringstream text;
    text << "angle " << angle_deg << ", albedo " << albedo;
    if (g)
        text << ", g " << *g;
    return text.str();
}

void check_alike(const LdfSample& a, const LdfSample& b)
{
    std::ostringstream text;
    if (a.width != b.width || a.height != b.height)
        text << "of " << a.width << " x " << a.height << " and of " << b.width << " x " << b.height << " texels";
    else if (!same(a.pitch / b.pitch, 1.0))
        text << "of pitch " << a.pitch << " and " << b.pitch;
    else if (!same(a.beam_diameter, b.beam_diameter))
        text << "of beam_diameter " << a.beam_diameter << " and " << b.beam_diameter;
    else if (a.g.has_value() != b.g.has_value())
        text << "with and without g";
    else
        return;
    reject("samples", text.str(), "samples that are alike in all but angle, albedo and the value of g");
}

Bracket bracket(const std::string& name, const std::vector<double>& values, double x)
{
    if (!(x >= values.front() || same(x, values.front())) || !(x <= values.back() || same(x, values.back()))) {
        std::ostringstream span;
        span << values.front() << " <= " << name << " <= " << values.back() << ", the span of the samples";
        reject(name, x, span.str());
    }
    for (const double value : values)
        if (same(x, value))
            return {value, value, 0.0};
    const auto above = std::upper_bound(values.begin() + 1, values.end() - 1, x);
    const double lower = *(above - 1);
    return {lower, *above, (x - lower) / (*above - lower)};
}

// Default height of Q over the image's width, as in Manabe et al. 2012: 100 units over a window of 150.
constexpr double height_per_width = 2.0 / 3.0;

struct WeightedSample {
    const LdfSample* sample;
    double weight;
};

std::vector<WeightedSample> linear_weights(const SampleCell& cell)
{
    std::vector<WeightedSample> weighted;
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t j = 0; j < 2; ++j)
            for (std::size_t k = 0; k < 2; ++k) {
                const double w = cell.angle.weight_of(i) * cell.albedo.weight_of(j) * cell.g.weight_of(k);
                if (w > 0.0)
                    weighted.push_back({cell.corners[i][j][k], w});
            }
    return weighted;
}

void blend_planar(LdfSample& result, const std::vector<WeightedSample>& weighted)
{
    for (std::size_t i = 0; i < result.image.size(); ++i) {
        double sum = 0.0;
        for (const auto& [sample, weight] : weighted)
            sum += weight * static_cast<double>(sample->image[i]);
        result.image[i] = static_cast<float>(sum);
    }
}

void blend_angular(LdfSample& result, const std::vector<WeightedSample>& weighted, double height)
{
    const Vec2 origin(0.0, 0.0);
    Vec2 brightest(0.0, 0.0);
    std::vector<AngularSpace> spaces;
    for (const auto& [sample, weight] : weighted) {
        spaces.emplace_back(origin, brightest_point(*sample), height);
        brightest += weight * spaces.back().brightest();
    }
    const AngularSpace space(origin, brightest, height);
    for (std::size_t y = 0; y < result.height; ++y) {
        for (std::size_t x = 0; x < result.width; ++x) {
            const AngularCoordinates at = space.to_angular(Vec2(result.u(x), result.v(y)));
            double sum = 0.0;
            for (std::size_t k = 0; k < weighted.size(); ++k)
                sum += weighted[k].weight * exitance_at(*weighted[k].sample, spaces[k].to_planar(at));
            result.image[y * result.width + x] = static_cast<float>(sum);
        }
    }
}

}  // namespace

SampleGrid::SampleGrid(std::vector<const LdfSample*> samples) : m_samples(std::move(samples))
{
    if (m_samples.empty())
        reject("samples", "empty", "at least one sample");
    for (const LdfSample* sample : m_samples)
        check_alike(first(), *sample);
    m_angles = axis(m_samples, [](const LdfSample& s) { return s.angle_deg; });
    m_albedos = axis(m_samples, [](const LdfSample& s) { return s.albedo; });
    if (first().g)
        m_gs = axis(m_samples, [](const LdfSample& s) { return *s.g; });

    std::vector<std::optional<double>> gs(m_gs.begin(), m_gs.end());
    if (gs.empty())
        gs.emplace_back();
    for (const double angle : m_angles)
        for (const double albedo : m_albedos)
            for (const std::optional<double> g : gs)
                if (!find(angle, albedo, g))
                    reject("samples", "without one at " + description(angle, albedo, g),
                           "a regular grid: each angle with each albedo, and each g where there are several");
    if (m_samples.size() != m_angles.size() * m_albedos.size() * gs.size())
        reject("samples", "with two of the same angle, albedo and g", "one sample per corner of the grid");
}

const LdfSample* SampleGrid::find(double angle_deg, double albedo, std::optional<double> g) const
{
    const auto match = std::find_if(m_samples.begin(), m_samples.end(), [&](const LdfSample* s) {
        return same(s->angle_deg, angle_deg) && same(s->albedo, albedo) && (!g || same(*s->g, *g));
    });
    return match == m_samples.end() ? nullptr : *match;
}

SampleCell SampleGrid::cell(double angle_deg, double albedo, std::optional<double> g) const
{
    SampleCell cell;
    cell.angle = bracket("angle", m_angles, angle_deg);
    cell.albedo = bracket("albedo", m_albedos, albedo);
    if (m_gs.empty() && g)
        reject("g", *g, "None, as the samples have no g");
    if (m_gs.size() > 1 && !g) {
        std::ostringstream span;
        span << m_gs.front() << " <= g <= " << m_gs.back() << ", the span of the samples";
        reject("g", "None", span.str());
    }
    if (!m_gs.empty())
        cell.g = bracket("g", m_gs, g.value_or(m_gs.front()));
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t j = 0; j < 2; ++j)
            for (std::size_t k = 0; k < 2; ++k)
                cell.corners[i][j][k] =
                    find(i ? cell.angle.upper : cell.angle.lower, j ? cell.albedo.upper : cell.albedo.lower,
                         m_gs.empty() ? std::optional<double>() : std::optional(k ? cell.g.upper : cell.g.lower));
    return cell;
}

LdfSample interpolate(const std::vector<const LdfSample*>& samples, double angle_deg, double albedo,
                      std::optional<double> g, Interpolation method, std::optional<double> height)
{
    if (height && method != Interpolation::angular)
        reject("height", *height, "None, except for method 'angular'");
    if (height && !(*height > 0.0 && std::isfinite(*height)))
        reject("height", *height, "height > 0 mean free paths");
    const SampleGrid grid(samples);
    const SampleCell cell = grid.cell(angle_deg, albedo, g);
    LdfSample result = *cell.corners[0][0][0];
    const std::vector<WeightedSample> weighted = linear_weights(cell);
    if (weighted.size() > 1) {
        switch (method) {
            case Interpolation::planar:
                blend_planar(result, weighted);
                break;
            case Interpolation::angular:
                blend_angular(result, weighted,
                              height.value_or(height_per_width * static_cast<double>(result.width) * result.pitch));
                break;
            case Interpolation::adaptive:
                result.image = adaptive_image(cell, angle_deg, albedo, g);
                break;
        }
    }
    result.angle_deg = angle_deg;
    result.albedo = albedo;
    if (g)
        result.g = g;
    return result;
}

}  // namespace beamspread
