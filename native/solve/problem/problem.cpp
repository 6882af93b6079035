#include "solve/problem/problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/threads.h"
#include "medium/medium.h"
#include "simd/loops.h"
#include "solve/problem/beam_loops.h"

namespace beamspread {

namespace {

bool is_irradiance(float irradiance)
{
    return irradiance >= 0.0f && irradiance <= std::numeric_limits<float>::max();
}

bool is_unit(float x, float y, float z)
{
    return std::abs(x * x + y * y + z * z - 1.0f) < unit_tolerance;
}

void check_direction(const Vec3& d)
{
    if (!is_unit(static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)))
        reject("direction", "of length " + std::to_string(glm::length(d)), "unit vectors of travel");
    if (!(d.z < 0.0))
        reject("direction", "with z = " + std::to_string(d.z), "z < 0: light travels toward the surface");
}

bool is_row_fine(const View2D<const float>& irradiance, const float* directions, std::size_t y)
{
    if (directions == nullptr) {
        bool fine = true;
        for (std::size_t x = 0; x < irradiance.width; ++x)
            fine &= is_irradiance(irradiance(y, x));
        return fine;
    }
    constexpr std::size_t at_once = 256;
    std::array<float, at_once> values;
    for (std::size_t x = 0; x < irradiance.width; x += at_once) {
        const std::size_t count = std::min(at_once, irradiance.width - x);
        copy_row(irradiance, y, x, count, values.data());
        if (!are_beams(values.data(), directions + 3 * (y * irradiance.width + x), count))
            return false;
    }
    return true;
}

// Says what is wrong in a row that is not fine.
void check_row(const View2D<const float>& irradiance, const float* directions, std::size_t y)
{
    for (std::size_t x = 0; x < irradiance.width; ++x)
        if (!is_irradiance(irradiance(y, x)))
            reject("irradiance", static_cast<double>(irradiance(y, x)), "finite values >= 0 W/m^2");
    const float* d = directions + 3 * y * irradiance.width;
    for (std::size_t x = 0; x < irradiance.width; ++x, d += 3)
        if (irradiance(y, x) > 0.0f)
            check_direction(Vec3(d[0], d[1], d[2]));
}

void check_light(const View2D<const float>& irradiance, const float* directions)
{
    std::vector<char> fine(irradiance.height);
    parallel_for(irradiance.height, [&](std::size_t y) { fine[y] = is_row_fine(irradiance, directions, y) ? 1 : 0; });
    for (std::size_t y = 0; y < irradiance.height; ++y)
        if (fine[y] == 0)
            check_row(irradiance, directions, y);
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
    if (problem.directions.field == nullptr)
        check_direction(problem.directions.uniform);
    const float* checked = nullptr;
    for (const Channel& channel : problem.channels) {
        check_albedo(channel.albedo);
        if (!(channel.mean_free_path > 0.0 && std::isfinite(channel.mean_free_path)))
            reject("mean_free_path", channel.mean_free_path, "mean_free_path > 0 metres");
        if (channel.irradiance.data != checked)
            with_threads(problem.threads, [&] { check_light(channel.irradiance, problem.directions.field); });
        checked = channel.irradiance.data;
    }
}

}  // namespace beamspread
