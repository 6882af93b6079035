#include "solve/light_field.h"

#include "base/threads.h"

namespace beamspread {

LightField::LightField(const Problem& problem, Progress& progress) : m_problem(problem)
{
    with_threads(problem.threads, [&] {
        validate(problem);
        m_field = std::make_unique<SpectralField>(problem, progress);
        if (!problem.coming.survey.empty())
            m_unscattered.emplace(problem);
    });
    if (m_unscattered && m_unscattered->none())
        m_unscattered.reset();
    m_problem.coming = {};  // its arrays may be gone
}

void LightField::add(const RayRow& rays, const std::vector<double>& color, bool is_colored)
{
    m_field->add(rays, color, is_colored);
    if (m_unscattered)
        m_unscattered->add(rays, color);
}

void LightField::solve(Progress& progress, float* luminance)
{
    with_threads(m_problem.threads, [&] {
        m_field->solve(progress, luminance);
        add_unscattered(m_problem, luminance);
    });
    if (m_unscattered)
        m_unscattered->add_to(luminance);
}

void LightField::clear()
{
    m_field->clear();
    if (m_unscattered)
        m_unscattered->clear();
}

}  // namespace beamspread
