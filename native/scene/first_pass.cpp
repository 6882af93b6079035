#include "scene/first_pass.h"

#include <algorithm>

namespace beamspread {

FirstPass::FirstPass(std::size_t width, std::size_t height, std::size_t rays, std::uint32_t seed)
    : m_width(width), m_height(height), m_met(width * height), m_search(width, height, rays, seed)
{
}

void FirstPass::note(std::size_t x, std::size_t y, const LightHit& hit, const Vec3f& transmittance)
{
    const bool is_blocked = transmittance == Vec3f(0.0f);
    m_met[y * m_width + x] |= transmittance == Vec3f(1.0f) ? Met::light : is_blocked ? Met::obstacle : Met::both;
    m_search.note(x, y, hit, is_blocked);
}

void FirstPass::find_met_around(std::size_t y, std::vector<std::uint8_t>& around) const
{
    around.assign(m_width, Met::nothing);
    for (std::size_t row = y > 0 ? y - 1 : 0; row <= std::min(y + 1, m_height - 1); ++row)
        for (std::size_t x = 0; x < m_width; ++x)
            for (std::size_t beside = x > 0 ? x - 1 : 0; beside <= std::min(x + 1, m_width - 1); ++beside)
                around[x] |= m_met[row * m_width + beside];
}

RayMethod FirstPass::method_of(std::uint8_t met_around, bool is_rare, bool has_guide)
{
    switch (met_around) {
        case Met::nothing:
            return RayMethod::none;
        case Met::light:
            return RayMethod::open;
        case Met::both:
            return is_rare && has_guide ? RayMethod::guided : RayMethod::even;
        default:
            if (!has_guide)
                return RayMethod::single;
            return is_rare ? RayMethod::guided : RayMethod::few_guided;
    }
}

void FirstPass::Row::find(const FirstPass& pass, std::size_t y)
{
    // A thread mostly takes the rows of a tile one after the other, which share guides.
    if (!m_pass || m_y / LightSearch::tile_side != y / LightSearch::tile_side)
        m_guides.assign(pass.m_search.columns(), {});
    m_pass = &pass;
    m_y = y;
    pass.find_met_around(y, m_met_around);
    m_methods.resize(pass.m_width);
    for (std::size_t x = 0; x < pass.m_width; ++x)
        m_methods[x] = m_met_around[x] <= Met::light ? method_of(m_met_around[x], false, false)
                                                     : method_of(m_met_around[x], pass.m_search.is_rare(x, y),
                                                                 pass.m_search.has_hits_around(x, y));
}

const LightGuide& FirstPass::Row::guide(std::size_t x)
{
    LightGuide& guide = m_guides[x / LightSearch::tile_side];
    if (guide.empty())
        m_pass->m_search.find_guide(x, m_y, guide);
    return guide;
}

}  // namespace beamspread
