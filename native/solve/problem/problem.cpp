#include "solve/problem/problem.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "base/threads.h"
#include "medium/medium.h"

namespace beamspread {

namespace {

// Largest irradiance, W/m^2. Sums over 10^8 texels and products with kernels then stay in single precision.
constexpr float max_irradiance = 1e30f;

// Largest mean free path, texels. The widest plane, 65536 texels, then lies within the first radius bin of LDFs, 2^-10.
constexpr double max_path_texels = 1e8;

// Largest ratio of a texel's sides. Solver `fft` tabulates kernels in units of the longer side; time and memory grow
// with the ratio.
constexpr double max_aspect = 1000.0;

// Largest difference of a direction's squared length from 1. Half precision rounds unit vectors by 1e-3.
constexpr double unit_tolerance = 2e-3;

void check_direction(const Vec3& d)
{
    if (!(std::abs(glm::dot(d, d) - 1.0) < unit_tolerance))
        reject("direction", "of length " + std::to_string(glm::length(d)), "unit vectors of travel");
    if (!(d.z < 0.0))
        reject("direction", "with z = " + std::to_string(d.z), "z < 0: light travels toward the surface");
}

// `entering`: largest factor of light that enters.
void check_row(const PlaneLight& light, std::size_t y, float entering)
{
    const auto* field = std::get_if<PerTexel>(&light.directions);
    for (std::size_t x = 0; x < light.irradiance.width; ++x) {
        const float irradiance = light.irradiance(y, x);
        if (!(irradiance >= 0.0f && irradiance <= max_irradiance / entering))
            reject("irradiance", static_cast<double>(irradiance), "0 to 1e30 W/m^2");
        if (field != nullptr && irradiance > 0.0f) {
            const float* d = field->travel + 3 * (y * light.irradiance.width + x);
            check_direction(Vec3(d[0], d[1], d[2]));
        }
    }
}

void check_light(const Plane& plane, std::size_t channels, const PlaneLight& light, float entering)
{
    const View2D<const float>& irradiance = light.irradiance;
    if (irradiance.width != plane.width || irradiance.height != plane.height)
        reject("irradiance", std::to_string(irradiance.height) + " x " + std::to_string(irradiance.width) + " texels",
               "as many for all lights");
    if (light.color.size() != channels)
        reject("color", std::to_string(light.color.size()) + " channels", "as many as there are media");
    for (const double part : light.color)
        if (!(part >= 0.0 && part <= static_cast<double>(max_irradiance)))
            reject("color", part, "0 to 1e30");
    if (const auto* parallel = std::get_if<OneDirection>(&light.directions))
        check_direction(parallel->travel);
    if (const auto* point = std::get_if<FromPoint>(&light.directions); point != nullptr && !(point->position.z > 0.0))
        reject("position", point->position.z, "above the plane");
    parallel_for(irradiance.height, [&](std::size_t y) { check_row(light, y, entering); });
}

// The largest factor of light that enters, at least 1.
float checked_entering(const Problem& problem)
{
    float most = 1.0f;
    const std::size_t count = problem.entering ? problem.plane.texels() * problem.channels.size() : 0;
    for (std::size_t i = 0; i < count; ++i) {
        const float factor = problem.entering[i];
        if (!(factor >= 0.0f && factor <= max_irradiance))
            reject("entering", static_cast<double>(factor), "0 to 1e30");
        most = std::max(most, factor);
    }
    if (problem.entering && problem.solver != Solver::fft)
        reject("entering", "factors", "none for solvers other than 'fft'");
    return most;
}

// Largest relative difference of proportional colours. Quotients of single-precision colours are off by up to 1.2e-7.
constexpr double same_color = 1e-6;

// The factor between the light of two channels; 0 if they are not proportional.
double common_factor(const std::vector<std::vector<double>>& colors, std::size_t channel, std::size_t reference)
{
    double factor = 0.0;
    for (const std::vector<double>& color : colors)
        if (color[reference] > 0.0)
            factor = std::max(factor, color[channel] / color[reference]);
    for (const std::vector<double>& color : colors)
        if (std::abs(color[channel] - factor * color[reference]) > same_color * color[channel])
            return 0.0;
    return factor;
}

// True if light of two channels enters by the same factors at all texels.
bool enter_alike(const Problem& problem, std::size_t channel, std::size_t reference)
{
    const std::size_t channels = problem.channels.size();
    const std::size_t count = problem.entering ? problem.plane.texels() * channels : 0;
    for (std::size_t i = 0; i < count; i += channels)
        if (problem.entering[i + channel] != problem.entering[i + reference])
            return false;
    return true;
}

}  // namespace

const PlanePart* part_with(const std::vector<PlanePart>& parts, std::size_t y, std::size_t x)
{
    const auto part = std::ranges::find_if(parts, [&](const PlanePart& other) {
        return y - other.y < other.height && x - other.x < other.width;  // unsigned
    });
    return part == parts.end() ? nullptr : &*part;
}

void validate(const Problem& problem)
{
    const Plane& plane = problem.plane;
    if (plane.texels() == 0)
        reject("irradiance", "empty", "at least one texel");
    for (const double pitch : {plane.pitch_x, plane.pitch_y})
        if (!(pitch > 0.0 && std::isfinite(pitch)))
            reject("pitch", pitch, "pitch > 0 metres");
    const auto [shorter, longer] = std::minmax(plane.pitch_x, plane.pitch_y);
    if (problem.solver == Solver::fft && longer > max_aspect * shorter)
        reject("pitch", longer / shorter, "sides of a ratio up to 1000 for the solver 'fft'");
    if (!(problem.tolerance > 0.0))
        reject("tolerance", problem.tolerance, "tolerance > 0");
    if (problem.coarsening > 64 || problem.coarsening == 2 || (problem.coarsening & (problem.coarsening - 1)) != 0)
        reject("coarsening", static_cast<double>(problem.coarsening), "0, 1, 4, 8, 16, 32, 64");
    for (const ChannelMedium& channel : problem.channels) {
        check_albedo(channel.albedo);
        if (!(channel.mean_free_path > 0.0 && channel.mean_free_path <= max_path_texels * shorter))
            reject("mean_free_path", channel.mean_free_path, "above 0 metres, and up to 1e8 texels");
    }
    if (problem.lights.empty() && problem.coming.survey.empty())
        reject("lights", "empty", "at least one light");
    const float entering = checked_entering(problem);
    for (const auto* lights : {&problem.lights, &problem.coming.examples})
        for (const PlaneLight& light : *lights)
            check_light(plane, problem.channels.size(), light, entering);
    for (const SurveyedLight& surveyed : problem.coming.survey)
        check_light(surveyed.plane, problem.channels.size(), surveyed.light, entering);
}

ChannelSets::ChannelSets(const Problem& problem)
{
    std::vector<std::vector<double>> colors;
    for (const auto* lights : {&problem.lights, &problem.coming.examples})
        for (const PlaneLight& light : *lights)
            colors.push_back(light.color);
    for (const SurveyedLight& surveyed : problem.coming.survey)
        colors.push_back(surveyed.light.color);
    for (std::size_t c = 0; c < problem.channels.size(); ++c) {
        double factor = 0.0;
        std::size_t set = 0;
        Source source{m_reference.size(), 1.0};
        while (set < m_reference.size()) {
            factor = common_factor(colors, c, m_reference[set]);
            if (factor != 0.0 && enter_alike(problem, c, m_reference[set]))
                break;
            if (factor != 0.0 && source.set == m_reference.size())
                source = {set, factor};
            ++set;
        }
        if (set == m_reference.size()) {
            m_reference.push_back(c);
            m_sources.push_back(source);
            factor = 1.0;
        }
        const auto known = std::find(media.begin(), media.end(), problem.channels[c]);
        const auto medium = static_cast<std::size_t>(known - media.begin());
        if (known == media.end())
            media.push_back(problem.channels[c]);
        const auto shared = std::find_if(results.begin(), results.end(), [&](const Result& result) {
            return result.set == set && result.medium == medium;
        });
        if (shared == results.end())
            results.push_back({set, medium, {{c, factor}}});
        else
            shared->members.push_back({c, factor});
    }
}

std::vector<std::size_t> ChannelSets::results_of(std::size_t set) const
{
    std::vector<std::size_t> of_set;
    for (std::size_t r = 0; r < results.size(); ++r)
        if (results[r].set == set)
            of_set.push_back(r);
    return of_set;
}

void clip_negative(float* values, std::size_t count)
{
    // NaN stays: it is an error that callers find.
    for (std::size_t i = 0; i < count; ++i)
        values[i] = values[i] < 0.0f ? 0.0f : values[i];
}

}  // namespace beamspread
