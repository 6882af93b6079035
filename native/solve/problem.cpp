#include "solve/problem.h"

#include <cmath>

#include "base/error.h"
#include "ldf/library.h"

namespace beamspread {

namespace {

void check_direction(const Vec3& d)
{
    // Single-precision unit vectors are off by 1e-7; what is off by more was never normalized.
    if (!(std::abs(glm::dot(d, d) - 1.0) < 2e-3))
        reject("direction", "of length " + std::to_string(glm::length(d)), "unit vectors of travel");
    if (!(d.z < 0.0))
        reject("direction", "with z = " + std::to_string(d.z), "z < 0: light travels toward the surface");
}

void check_irradiance(const View2D<const float>& irradiance)
{
    for (std::size_t y = 0; y < irradiance.height; ++y)
        for (std::size_t x = 0; x < irradiance.width; ++x)
            if (!(irradiance(y, x) >= 0.0f && std::isfinite(irradiance(y, x))))
                reject("irradiance", static_cast<double>(irradiance(y, x)), "finite values >= 0 W/m^2");
}

}  // namespace

void validate(const Problem& problem)
{
    if (problem.width == 0 || problem.height == 0)
        reject("irradiance", "empty", "at least one texel");
    for (double pitch : {problem.pitch_x, problem.pitch_y})
        if (!(pitch > 0.0 && std::isfinite(pitch)))
            reject("pitch", pitch, "pitch > 0 metres");
    if (!(problem.tolerance > 0.0))
        reject("tolerance", problem.tolerance, "tolerance > 0");
    if (problem.coarsening > 64 || problem.coarsening == 2 || (problem.coarsening & (problem.coarsening - 1)) != 0)
        reject("coarsening", static_cast<double>(problem.coarsening), "0, 1, 4, 8, 16, 32, 64");
    const float* checked = nullptr;
    for (const Channel& channel : problem.channels) {
        check_albedo(channel.albedo);
        if (!(channel.mean_free_path > 0.0 && std::isfinite(channel.mean_free_path)))
            reject("mean_free_path", channel.mean_free_path, "mean_free_path > 0 metres");
        if (channel.irradiance.data != checked)
            check_irradiance(channel.irradiance);
        checked = channel.irradiance.data;
    }
    if (!problem.directions.field) {
        check_direction(problem.directions.uniform);
        return;
    }
    for (std::size_t y = 0; y < problem.height; ++y) {
        for (std::size_t x = 0; x < problem.width; ++x) {
            bool lit = false;
            for (const Channel& channel : problem.channels)
                lit = lit || channel.irradiance(y, x) > 0.0f;
            const float* d = problem.directions.field + 3 * (y * problem.width + x);
            if (lit)
                check_direction(Vec3(d[0], d[1], d[2]));
        }
    }
}

}  // namespace beamspread
