#include "solve/term_choice/radiance_probe.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include <glm/mat2x2.hpp>

#include "base/random.h"

namespace beamspread {

namespace {

// Number of texel pairs from which sites are drawn, and their largest distances in texels: light edges, patterns of a
// site, and wider ones. More pairs: edges are found more reliably, more time.
constexpr std::size_t pairs = 4096;
constexpr std::array<std::size_t, 3> pair_reach = {1, site_reach, 4 * site_reach};

// Number of sites anywhere, and of sites at pairs with different light. More: smaller errors, more terms.
constexpr std::size_t anywhere = 32;
constexpr std::size_t changing = 32;

// Largest distances, in texels, of the sites around each extreme of a light. More: smaller errors, more time.
constexpr std::array<std::size_t, 4> extreme_reach = {0, site_reach / 2, 3 * site_reach / 2, 7 * site_reach / 2};

// Largest distance, in texels, of `sites_around`.
constexpr std::size_t around_reach = 3 * site_reach / 2;

// Sites on the parts of a plane: in the gaps between these, which are dark, no luminance is wanted.
class Sites {
public:
    Sites(const Plane& plane, std::size_t stream) : m_parts(plane.parts), m_random(0, stream, 0)
    {
        if (m_parts.empty())
            m_parts.push_back({.height = plane.height, .width = plane.width});
        for (const PlanePart& part : m_parts)
            m_ends.push_back((m_ends.empty() ? 0 : m_ends.back()) + part.height * part.width);
    }

    // The part with a texel; null in a gap.
    const PlanePart* part_of(const Texel& texel) const { return part_with(m_parts, texel.y, texel.x); }

    Texel anywhere()
    {
        if (m_parts.size() == 1)
            return {m_parts.front().y + below(m_parts.front().height),
                    m_parts.front().x + below(m_parts.front().width)};
        const std::size_t texel = below(m_ends.back());
        const auto end = std::ranges::upper_bound(m_ends, texel);
        const PlanePart& part = m_parts[static_cast<std::size_t>(end - m_ends.begin())];
        const std::size_t in_part = texel + part.height * part.width - *end;
        return {part.y + in_part / part.width, part.x + in_part % part.width};
    }

    // A texel of the same part.
    Texel near(const Texel& texel, std::size_t reach)
    {
        const PlanePart& part = *part_of(texel);
        return {part.y + near(texel.y - part.y, reach, part.height),
                part.x + near(texel.x - part.x, reach, part.width)};
    }

    // Adds the middle, and one texel from each of the eight parts of the square around it.
    void add(const Texel& middle)
    {
        const PlanePart& part = *part_of(middle);
        for (std::size_t i = 0; i < texels_per_site; ++i)
            m_texels.push_back(i == texels_per_site / 2 ? middle
                                                        : Texel{part.y + within(middle.y - part.y, i / 3, part.height),
                                                                part.x + within(middle.x - part.x, i % 3, part.width)});
    }

    std::vector<Texel> take() { return std::move(m_texels); }

private:
    std::size_t below(std::size_t end)
    {
        return static_cast<std::size_t>(m_random.uniform() * static_cast<double>(end));
    }

    std::size_t near(std::size_t at, std::size_t reach, std::size_t size)
    {
        const std::size_t first = at - std::min(at, reach);
        return first + below(std::min(size, at + reach + 1) - first);
    }

    // A random texel in one third of those within `site_reach` that lie on the plane.
    std::size_t within(std::size_t at, std::size_t third, std::size_t size)
    {
        const std::size_t first = at - std::min(at, site_reach);
        const auto count = static_cast<double>(std::min(size, at + site_reach + 1) - first);
        const double part = (static_cast<double>(third) + m_random.uniform()) / 3.0;
        return first + static_cast<std::size_t>(part * count);
    }

    std::vector<PlanePart> m_parts;
    std::vector<std::size_t> m_ends;  // numbers of texels up to the end of each part
    Random m_random;
    std::vector<Texel> m_texels;
};

// Difference of the light of two texels, relative to the light.
float change(const LightTerms& light, const std::vector<std::size_t>& lights, const Texel& a, const Texel& b)
{
    float sum = 0.0f;
    float difference = 0.0f;
    for (const std::size_t l : lights) {
        const auto flow = [&](const Texel& texel) {
            float strength = 0.0f;
            for (std::size_t set = 0; set < light.colors[l].size(); ++set)
                strength += light.colors[l][set] * light.entering_factor(set, texel.y, texel.x);
            const float irradiance = strength * light.changing[l].irradiance(texel.y, texel.x);
            const Vec3 travel = travel_at(light.plane, light.changing[l].directions, texel.y, texel.x);
            sum += irradiance;
            return irradiance > 0.0f ? irradiance * Vec3f(glm::normalize(travel)) : Vec3f(0.0f);
        };
        difference += glm::length(flow(a) - flow(b));
    }
    return sum > 0.0f ? difference / sum : 0.0f;
}

// The texel nearest to the lines along which the beams at some texels travel. Around a lamp, harmonics of any order add
// up with the same sign, in the dark too. None if the lines are parallel or meet outside the plane.
std::optional<Texel> origin(const Plane& plane, const PlaneLight& light, const std::vector<Texel>& texels)
{
    glm::dmat2 sum(0.0);  // of the projections across the lines
    Vec2 projected(0.0);
    for (const auto& [y, x] : texels) {
        const Vec3 travel = travel_at(plane, light.directions, y, x);
        const Vec2 along(travel.x / plane.pitch_x, travel.y / plane.pitch_y);
        if (light.irradiance(y, x) == 0.0f || along == Vec2(0.0))
            continue;
        const Vec2 across = glm::normalize(Vec2(along.y, -along.x));
        sum += glm::outerProduct(across, across);
        projected += across * glm::dot(across, Vec2(x, y));
    }
    constexpr double parallel = 1e-6;  // square of an angle of a thousandth of a radian
    const double trace = sum[0][0] + sum[1][1];
    if (glm::determinant(sum) <= parallel * trace * trace)
        return std::nullopt;
    const Vec2 point = glm::inverse(sum) * projected;
    const bool on_plane = point.x >= 0.0 && point.y >= 0.0 && point.x < static_cast<double>(plane.width) &&
                          point.y < static_cast<double>(plane.height);
    return on_plane ? std::optional(Texel{static_cast<std::size_t>(point.y), static_cast<std::size_t>(point.x)})
                    : std::nullopt;
}

}  // namespace

std::vector<Texel> probe_sites(const LightTerms& light, const std::vector<std::size_t>& lights,
                               const Incidence& incidence)
{
    Sites sites(light.plane, 0);
    const Texel last{light.plane.height - 1, light.plane.width - 1};
    for (const Texel& corner : {Texel{0, 0}, Texel{0, last.x}, Texel{last.y, 0}, last})
        if (sites.part_of(corner))
            sites.add(corner);
    std::vector<Texel> drawn;
    std::vector<float> sums;  // cumulative changes
    for (std::size_t i = 0; i < pairs; ++i) {
        const Texel texel = sites.anywhere();
        const Texel neighbour = sites.near(texel, pair_reach[i % pair_reach.size()]);
        drawn.push_back(i % 2 == 0 ? texel : neighbour);
        sums.push_back((sums.empty() ? 0.0f : sums.back()) + change(light, lights, texel, neighbour));
    }
    for (std::size_t i = 0; i < anywhere; ++i)
        sites.add(drawn[i]);
    for (std::size_t i = 0; i < changing && sums.back() > 0.0f; ++i) {
        const float quantile = sums.back() * (static_cast<float>(i) + 0.5f) / static_cast<float>(changing);
        sites.add(drawn[static_cast<std::size_t>(std::ranges::lower_bound(sums, quantile) - sums.begin())]);
    }
    for (const std::size_t l : lights) {
        const Incidence::Extremes& extremes = incidence.extremes[l];
        if (extremes.irradiance == 0.0)
            continue;
        std::vector<Texel> texels = {extremes.brightest, extremes.steepest, extremes.most_grazing};
        const std::optional<Texel> lamp = origin(light.plane, light.changing[l], drawn);
        if (lamp && sites.part_of(*lamp))
            texels.push_back(*lamp);
        for (const Texel& texel : texels)
            for (const std::size_t reach : extreme_reach)
                sites.add(sites.near(texel, reach));
    }
    return sites.take();
}

std::vector<Texel> sites_around(const std::vector<Texel>& texels, const Plane& plane, std::size_t draw)
{
    Sites sites(plane, 1 + draw);
    for (const Texel& texel : texels)
        sites.add(sites.near(texel, around_reach));
    return sites.take();
}

}  // namespace beamspread
