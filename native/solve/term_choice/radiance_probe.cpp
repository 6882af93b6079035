#include "solve/term_choice/radiance_probe.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/constants.h"
#include "base/random.h"
#include "base/threads.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Rings per octave of radius. More: fewer terms, more time.
constexpr double rings_per_octave = 3.0;

// Directions in near and far rings: above 64, the number of harmonics, so that even light cancels in all harmonics but
// 0. More: less noise, fewer terms, more time.
constexpr std::size_t near_directions = 96;
constexpr std::size_t far_directions = 384;

// Steps of the tables over the angle, in which functions change by some per cent. More: more exact, more cache.
constexpr std::size_t angle_steps = 256;

// Radius, in texels, from which all texels of a site share a ring. Larger: more exact, more time.
constexpr double far_radius = 5.0 * static_cast<double>(site_reach);

}  // namespace

RadianceProbe::RadianceProbe(const LightTerms& light, std::vector<std::size_t> lights, const LowRankBasis& basis)
    : m_light(light),
      m_lights(std::move(lights)),
      m_first_angle(static_cast<float>(basis.first)),
      m_steps_per_angle(basis.last > basis.first ? static_cast<float>(angle_steps / (basis.last - basis.first)) : 0.0f)
{
    std::vector<std::size_t> harmonics(basis.profiles.front().size(), 0);  // [rank]
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        harmonics[function.rank] = std::max(harmonics[function.rank], function.m + 1);
    std::vector<std::size_t> starts;
    for (const std::size_t count : harmonics) {
        starts.push_back(m_row_size);
        for (std::size_t m = 0; m < count; m += harmonics_per_block) {
            m_columns.push_back(m);
            m_row_size += harmonics_per_block;
            m_harmonics = std::max(m_harmonics, m + harmonics_per_block);
        }
    }
    m_by_angle.resize(angle_steps * m_row_size);
    for (const auto& [m, rank] : basis.functions)
        m_positions.push_back(starts[rank] + m);
    for (std::size_t step = 0; step < angle_steps; ++step) {
        const std::size_t of_basis = (2 * step + 1) * basis.steps / (2 * angle_steps);
        for (std::size_t f = 0; f < basis.functions.size(); ++f)
            m_by_angle[step * m_row_size + m_positions[f]] = basis.table[of_basis * basis.functions.size() + f].value;
    }

    double reach = 0.0;
    for (const std::vector<ScaledProfile>& profiles : basis.profiles)
        reach = std::max(reach, profiles.front().reach);
    const Plane& plane = light.plane;
    reach = std::min(reach, std::hypot(static_cast<double>(plane.width) * plane.pitch_x,
                                       static_cast<double>(plane.height) * plane.pitch_y));
    if (plane.gap > 0.0)
        reach = std::min(reach, plane.gap);
    if (plane.is_divided())
        reach = std::min(reach, plane.extent);
    // The first ring lies inside the texel itself.
    for (double r = 0.5 * std::min(plane.pitch_x, plane.pitch_y); m_radii.empty() || m_radii.back() < reach;
         r *= std::exp2(1.0 / rings_per_octave)) {
        m_radii.push_back(r);
        m_near += r < far_radius * std::max(plane.pitch_x, plane.pitch_y) ? 1 : 0;
    }

    const std::size_t media = basis.profiles.size();
    m_by_ring.resize(m_radii.size() * media * m_row_size);
    parallel_for(m_radii.size() * media, [&](std::size_t item) {
        const std::size_t ring = item / media;
        const auto directions = static_cast<double>(ring < m_near ? near_directions : far_directions);
        for (std::size_t rank = 0; rank < harmonics.size(); ++rank) {
            const auto& [profile, mean_free_path, end] = basis.profiles[item % media][rank];
            const Harmonics outer = profile.cumulative(m_radii[ring] / mean_free_path);
            const Harmonics inner = ring > 0 ? profile.cumulative(m_radii[ring - 1] / mean_free_path) : Harmonics{};
            for (std::size_t m = 0; m < harmonics[rank]; ++m)
                m_by_ring[item * m_row_size + starts[rank] + m] =
                    static_cast<float>(2.0 * pi * (outer[m] - inner[m]) / directions);
        }
    });
}

std::vector<std::vector<float>> RadianceProbe::read(std::span<const Texel> site) const
{
    const std::size_t results = m_light.sets.results.size();
    AlignedVector<float> far(results * m_row_size);
    add_rings(site[site.size() / 2], m_near, m_radii.size(), far);
    std::vector<std::vector<float>> parts;
    for (const Texel& texel : site) {
        AlignedVector<float> sums = far;
        add_rings(texel, 0, m_near, sums);
        parts.emplace_back();
        for (std::size_t r = 0; r < results; ++r)
            for (const std::size_t position : m_positions)
                parts.back().push_back(sums[r * m_row_size + position]);
    }
    return parts;
}

void RadianceProbe::add_rings(const Texel& texel, std::size_t first, std::size_t end, AlignedVector<float>& sums) const
{
    const std::size_t media = m_light.sets.media.size();
    const Plane& plane = m_light.plane;
    const PlanePart lit =
        plane.is_divided() ? *plane.part_of(texel.y, texel.x) : PlanePart{.height = plane.height, .width = plane.width};
    Random random(first, texel.y, texel.x);
    AlignedVector<float> cosines(m_harmonics);
    AlignedVector<float> moments(m_light.sets.count() * m_row_size);  // [set]
    for (std::size_t ring = first; ring < end; ++ring) {
        std::fill(moments.begin(), moments.end(), 0.0f);
        const std::size_t directions = ring < m_near ? near_directions : far_directions;
        const double step = 2.0 * pi / static_cast<double>(directions);
        const Vec2 turn(std::cos(step), std::sin(step));
        const double inner = ring > 0 ? m_radii[ring - 1] : 0.0;
        const double phi = random.uniform() * step;
        Vec2 toward_probe(std::cos(phi), std::sin(phi));  // from the light
        for (std::size_t i = 0; i < directions; ++i) {
            toward_probe = {toward_probe.x * turn.x - toward_probe.y * turn.y,
                            toward_probe.x * turn.y + toward_probe.y * turn.x};
            const double r = inner + random.uniform() * (m_radii[ring] - inner);
            const double x = static_cast<double>(texel.x) + 0.5 - r * toward_probe.x / plane.pitch_x;
            const double y = static_cast<double>(texel.y) + 0.5 - r * toward_probe.y / plane.pitch_y;
            if (!(x >= static_cast<double>(lit.x) && y >= static_cast<double>(lit.y) &&
                  x < static_cast<double>(lit.x + lit.width) && y < static_cast<double>(lit.y + lit.height)))
                continue;
            for (const std::size_t l : m_lights)
                add_beam(m_light.changing[l], m_light.colors[l],
                         {static_cast<std::size_t>(y), static_cast<std::size_t>(x)}, toward_probe, cosines, moments);
        }
        for (std::size_t r = 0; r < m_light.sets.results.size(); ++r) {
            const auto& [set, medium, members] = m_light.sets.results[r];
            add_scaled_product(sums.data() + r * m_row_size, moments.data() + set * m_row_size,
                               m_by_ring.data() + (ring * media + medium) * m_row_size, 1.0f, m_row_size);
        }
    }
}

// Adds irradiance times u(theta) times cos(m (phi - beta)), with phi the azimuth of the direction from the light to the
// probed texel.
void RadianceProbe::add_beam(const PlaneLight& light, const std::vector<float>& colors, const Texel& texel,
                             const Vec2& toward_probe, AlignedVector<float>& cosines,
                             AlignedVector<float>& moments) const
{
    const float irradiance = light.irradiance(texel.y, texel.x);
    if (irradiance == 0.0f)
        return;
    const Vec3 travel = travel_at(m_light.plane, light.directions, texel.y, texel.x);
    const double across = std::sqrt(travel.x * travel.x + travel.y * travel.y);
    const Vec2 beam = across > 0.0 ? Vec2(travel) / across : Vec2(1.0, 0.0);
    const auto half_tangent = static_cast<float>(across / (glm::length(travel) - travel.z));
    const auto step = static_cast<std::size_t>(std::max((half_tangent - m_first_angle) * m_steps_per_angle, 0.0f));
    const float* by_angle = m_by_angle.data() + std::min(step, angle_steps - 1) * m_row_size;
    multiple_angles(cosines.data(), static_cast<float>(glm::dot(beam, toward_probe)),
                    static_cast<float>(beam.x * toward_probe.y - beam.y * toward_probe.x), irradiance, m_harmonics);
    for (std::size_t set = 0; set < colors.size(); ++set)
        if (colors[set] != 0.0f)
            add_harmonics(moments.data() + set * m_row_size, by_angle, cosines.data(),
                          colors[set] * m_light.entering_factor(set, texel.y, texel.x), m_columns.data(),
                          m_columns.size());
}

}  // namespace beamspread
