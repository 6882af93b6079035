#include "solve/light_field.h"

#include <algorithm>
#include <variant>

#include "base/threads.h"
#include "simd/loops.h"
#include "solve/unscattered.h"

namespace beamspread {

namespace {

Problem checked(Problem problem)
{
    with_threads(problem.threads, [&] { validate(problem); });
    return problem;
}

}  // namespace

LightField::LightField(const Problem& problem, Progress& progress)
    : m_problem(checked(problem)), m_field(problem, progress), m_unscattered_rays(problem)
{
    if (!m_unscattered_rays.none())
        m_unscattered.resize(problem.plane.texels() * problem.channels.size());
    std::erase_if(m_problem.lights,
                  [](const PlaneLight& light) { return !std::holds_alternative<OneDirection>(light.directions); });
}

void LightField::add(const PlaneLight& light)
{
    with_threads(m_problem.threads, [&] {
        validate(m_problem, light);
        m_field.add(light);
        if (!m_unscattered.empty())
            add_unscattered(m_problem, light, m_unscattered.data());
    });
}

void LightField::add(const RayBeams& rays, const std::vector<double>& color, bool is_colored)
{
    m_field.add(rays, color, is_colored);
    m_unscattered_rays.add(rays, color);
}

void LightField::solve(Progress& progress, float* luminance)
{
    with_threads(m_problem.threads, [&] {
        m_field.solve(progress, luminance);
        add_unscattered(m_problem, luminance);
    });
    m_unscattered_rays.add_to(luminance);
    add_scaled(luminance, m_unscattered.data(), 1.0f, m_unscattered.size());
    progress.finish();
}

void LightField::clear()
{
    m_field.clear();
    std::fill(m_unscattered.begin(), m_unscattered.end(), 0.0f);
    m_unscattered_rays.clear();
}

}  // namespace beamspread
