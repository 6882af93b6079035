#include "solve/separable/angle_counts.h"

#include <algorithm>

namespace beamspread {

void AngleCounts::add(double half_tangent, double light, double texels)
{
    Bin& bin = m_bins[std::min(static_cast<std::size_t>(half_tangent * static_cast<double>(bins)), bins - 1)];
    bin.light += light;
    bin.texels += texels;
}

void AngleCounts::add(const AngleCounts& others)
{
    include(others.m_first, others.m_last);
    for (std::size_t i = 0; i < bins; ++i) {
        m_bins[i].light += others.m_bins[i].light;
        m_bins[i].texels += others.m_bins[i].texels;
    }
}

void AngleCounts::include(float first, float last)
{
    m_first = std::min(m_first, first);
    m_last = std::max(m_last, last);
}

}  // namespace beamspread
