#include "scene/first_pass.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "base/threads.h"

namespace beamspread {

namespace {

// Irradiance, as a fraction of the mean where light is seen, from which a texel has all guided rays. Darker ones have fewer
// in proportion, down to a fraction of all: noise counts against the mean. More: faster, and more noise in dim light.
constexpr double full_brightness = 0.125;
constexpr double min_share = 1.0 / 8.0;

// Noise of even rays where obstacles block a part f of the light, relative to the light that is left and to that where
// they block half of it: noise_scale (2 f)^(1/4) / (2 (1 - f)), as the rays that matter are those near the borders of
// obstacles. More: less noise where few obstacles are, in a longer time.
constexpr double noise_scale = 1.5;
// The number of rays that a noise takes grows as noise^-8/5, see `rays_per_texel` in spread_light.py.
constexpr double noise_power = 8.0 / 5.0;

}  // namespace

FirstPass::FirstPass(std::size_t width, std::size_t height, std::size_t first_rays, std::size_t rays,
                     std::uint32_t seed)
    : m_width(width),
      m_height(height),
      m_first_rays(first_rays),
      m_max_rays(rays),
      m_texels(width * height),
      m_search(width, height, rays, seed),
      m_texel_search(width, height, rays, seed)
{
}

void FirstPass::note(std::size_t x, std::size_t y, std::span<const std::uint8_t> met, std::span<const FirstRays> rays,
                     std::span<const LightHit> hits)
{
    FirstRays sum;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const float visible = rays[i].open > 0.0f ? std::min(rays[i].irradiance / rays[i].open, 1.0f) : 0.0f;
        m_texels[y * m_width + x + i] = {met[i], visible};
        sum.traced += rays[i].traced;
        sum.open += rays[i].open;
        sum.irradiance += rays[i].irradiance;
    }
    m_search.note(x, y, sum, hits);
}

void FirstPass::search(const ProbeLight& probe, Progress& progress)
{
    m_search.spread(probe, progress);
    const std::vector<std::size_t> tiles = m_search.find_hard_tiles();
    if (tiles.empty())
        return;
    // Other tiles with hits around keep their guides.
    std::vector<std::uint8_t> is_hard(m_search.columns() * ((m_height + tile_side - 1) / tile_side));
    for (const std::size_t tile : tiles)
        is_hard[tile] = true;
    std::vector<std::uint8_t> allowed(m_width * m_height);
    parallel_for(m_height, [&](std::size_t y) {
        for (std::size_t x = 0; x < m_width; ++x) {
            const RayMethod method = method_of(around(x, y).met, x, y);
            allowed[y * m_width + x] =
                method == RayMethod::single ||
                (method == RayMethod::guided && is_hard[y / tile_side * m_search.columns() + x / tile_side]);
        }
    });
    m_texel_search.spread(
        tiles, allowed,
        [this](std::size_t column, std::size_t row, LightGuide& guide) {
            m_search.find_guide(column * tile_side, row * tile_side, guide);
        },
        probe, progress);
}

FirstPass::Around FirstPass::around(std::size_t x, std::size_t y) const
{
    Around sum;
    std::size_t texels = 0;
    for (std::size_t row = y > 0 ? y - 1 : 0; row <= std::min(y + 1, m_height - 1); ++row)
        for (std::size_t column = x > 0 ? x - 1 : 0; column <= std::min(x + 1, m_width - 1); ++column) {
            const Texel& texel = m_texels[row * m_width + column];
            sum.met |= texel.met;
            sum.visible += static_cast<double>(texel.visible);
            ++texels;
        }
    // One ray more may get through, or be blocked.
    const double one_ray = 1.0 / static_cast<double>(m_first_rays);
    sum.blocked = 1.0 - (sum.visible - one_ray) / static_cast<double>(texels);
    sum.visible = (sum.visible + one_ray) / static_cast<double>(texels);
    return sum;
}

RayMethod FirstPass::method_of(std::uint8_t met_around, std::size_t x, std::size_t y) const
{
    switch (met_around) {
        case Met::nothing:
            return RayMethod::none;
        case Met::light:
            return RayMethod::open;
        case Met::both:
            return m_search.is_rare(x, y) && m_search.has_hits_around(x, y) ? RayMethod::guided : RayMethod::even;
        default:
            return m_search.has_hits_around(x, y) || m_texel_search.has_guide(x, y) ? RayMethod::guided
                                                                                    : RayMethod::single;
    }
}

std::size_t FirstPass::even_rays(double blocked) const
{
    if (blocked >= 0.5)
        return m_max_rays;
    const double noise = noise_scale * std::pow(2.0 * blocked, 0.25) / (2.0 * (1.0 - blocked));
    const double wanted = std::pow(noise, noise_power) * static_cast<double>(m_max_rays);
    // The nearest power of two, see `RaySettings::rays`.
    const auto nearest = std::bit_floor(static_cast<std::size_t>(std::ceil(wanted * std::numbers::sqrt2)));
    return std::clamp(nearest, m_first_rays, m_max_rays);
}

std::size_t FirstPass::guided_rays(double visible, std::size_t x, std::size_t y) const
{
    const double brightness = visible * m_search.open_brightness(x, y);
    const double share = std::clamp(brightness / full_brightness, min_share, 1.0);
    return std::bit_ceil(static_cast<std::size_t>(std::ceil(share * static_cast<double>(m_max_rays))));
}

void FirstPass::Row::find(const FirstPass& pass, std::size_t y)
{
    // A thread mostly takes the rows of a tile one after the other, which share guides.
    if (!m_pass || m_y / tile_side != y / tile_side)
        m_guides.assign(pass.m_search.columns(), {});
    m_pass = &pass;
    m_y = y;
    m_methods.resize(pass.m_width);
    m_rays.resize(pass.m_width);
    for (std::size_t x = 0; x < pass.m_width; ++x) {
        const Around around = pass.around(x, y);
        m_methods[x] = pass.method_of(around.met, x, y);
        switch (m_methods[x]) {
            case RayMethod::none:
                m_rays[x] = 0;
                break;
            case RayMethod::open:
                m_rays[x] = pass.m_first_rays;
                break;
            case RayMethod::even:
                m_rays[x] = pass.even_rays(around.blocked);
                break;
            case RayMethod::guided:
                m_rays[x] = pass.guided_rays(around.visible, x, y);
                break;
            case RayMethod::single:
                m_rays[x] = 1;
        }
    }
}

const LightGuide& FirstPass::Row::guide(std::size_t x)
{
    if (m_pass->m_texel_search.has_guide(x, m_y)) {
        m_pass->m_texel_search.find_guide(x, m_y, m_texel_guide);
        return m_texel_guide;
    }
    LightGuide& guide = m_guides[x / tile_side];
    if (guide.empty())
        m_pass->m_search.find_guide(x, m_y, guide);
    return guide;
}

}  // namespace beamspread
