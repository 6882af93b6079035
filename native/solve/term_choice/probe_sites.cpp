#include "solve/term_choice/probe_sites.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/random.h"

namespace beamspread {

namespace {

// Pairs of texels among which sites are drawn, and how far apart the two are at most.
constexpr std::size_t pairs = 4096;
constexpr std::array<std::size_t, 3> pair_reach = {1, 8, 32};

// Sites anywhere, along the sides of the plane and at its corners, beyond which all is dark, at lit texels, and where
// light changes from one texel of a pair to the other.
constexpr std::size_t anywhere = 16;
constexpr std::size_t per_side = 4;
constexpr std::size_t lit = 16;
constexpr std::size_t changing = 32;

// Sites around each place where a light is extreme, at most so many texels away.
constexpr std::array<std::size_t, 4> extreme_reach = {0, 4, 12, 28};

// And around each texel that sites are asked around.
constexpr std::size_t around_reach = 12;

class Sites {
public:
    Sites(const Plane& plane, std::size_t stream) : m_plane(plane), m_random(0, stream, 0) {}

    std::size_t below(std::size_t end)
    {
        return static_cast<std::size_t>(m_random.uniform() * static_cast<double>(end));
    }

    Texel anywhere() { return {below(m_plane.height), below(m_plane.width)}; }

    Texel near(const Texel& texel, std::size_t reach)
    {
        return {near(texel.y, reach, m_plane.height), near(texel.x, reach, m_plane.width)};
    }

    // The middle, and one texel from each eighth of the square around it.
    void add(const Texel& middle)
    {
        for (std::size_t i = 0; i < texels_per_site; ++i)
            m_texels.push_back(i == texels_per_site / 2 ? middle
                                                        : Texel{within(middle.y, i / 3, m_plane.height),
                                                                within(middle.x, i % 3, m_plane.width)});
    }

    std::vector<Texel> take() { return std::move(m_texels); }

private:
    std::size_t near(std::size_t at, std::size_t reach, std::size_t size)
    {
        const std::size_t first = at - std::min(at, reach);
        return first + below(std::min(size, at + reach + 1) - first);
    }

    // In a third of the texels from `site_reach` before to as many behind that lie on the plane.
    std::size_t within(std::size_t at, std::size_t third, std::size_t size)
    {
        const std::size_t first = at - std::min(at, site_reach);
        const auto count = static_cast<double>(std::min(size, at + site_reach + 1) - first);
        const double part = (static_cast<double>(third) + m_random.uniform()) / 3.0;
        return first + static_cast<std::size_t>(part * count);
    }

    const Plane& m_plane;
    Random m_random;
    std::vector<Texel> m_texels;
};

// By how much the light of two texels differs, relative to the light.
float change(const LightTerms& light, const std::vector<std::size_t>& lights, const Texel& a, const Texel& b)
{
    float sum = 0.0f;
    float difference = 0.0f;
    for (const std::size_t l : lights) {
        const float strength = std::accumulate(light.colors[l].begin(), light.colors[l].end(), 0.0f);
        const auto flow = [&](const Texel& texel) {
            const float irradiance = strength * light.changing[l].irradiance(texel.y, texel.x);
            sum += irradiance;
            if (irradiance == 0.0f)
                return Vec3f(0.0f);
            return irradiance *
                   Vec3f(glm::normalize(travel_at(light.plane, light.changing[l].directions, texel.y, texel.x)));
        };
        difference += glm::length(flow(a) - flow(b));
    }
    return sum > 0.0f ? difference / sum : 0.0f;
}

// The place nearest to the lines that the beams at some texels travel along, in texels; none if they are parallel.
std::optional<Vec2> common_origin(const Plane& plane, const PlaneLight& light, const std::vector<Texel>& texels)
{
    // Sums of I - d d^T and of its product with the place, d along the plane.
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    Vec2 sum(0.0);
    for (const auto& [y, x] : texels) {
        if (light.irradiance(y, x) == 0.0f)
            continue;
        const Vec3 travel = travel_at(plane, light.directions, y, x);
        const Vec2 d(travel.x / plane.pitch_x, travel.y / plane.pitch_y);
        const double length_squared = glm::dot(d, d);
        if (length_squared == 0.0)
            continue;
        const Vec2 across(d.y, -d.x);
        const double offset = glm::dot(across, Vec2(x, y));
        xx += d.y * d.y / length_squared;
        xy -= d.x * d.y / length_squared;
        yy += d.x * d.x / length_squared;
        sum += across * offset / length_squared;
    }
    constexpr double parallel = 1e-6;
    const double determinant = xx * yy - xy * xy;
    if (determinant <= parallel * (xx + yy) * (xx + yy))
        return std::nullopt;
    return Vec2(yy * sum.x - xy * sum.y, xx * sum.y - xy * sum.x) / determinant;
}

// The texel that all beams of a lamp travel away from: around it harmonics of any order add up with the same sign, also
// where it is dark.
std::optional<Texel> origin(const Plane& plane, const PlaneLight& light, const std::vector<Texel>& texels)
{
    const auto* point = std::get_if<FromPoint>(&light.directions);
    const std::optional<Vec2> place = point != nullptr
                                          ? Vec2(point->position.x / plane.pitch_x, point->position.y / plane.pitch_y)
                                          : common_origin(plane, light, texels);
    if (!place || !(place->x >= 0.0 && place->y >= 0.0 && place->x < static_cast<double>(plane.width) &&
                    place->y < static_cast<double>(plane.height)))
        return std::nullopt;
    return Texel{static_cast<std::size_t>(place->y), static_cast<std::size_t>(place->x)};
}

}  // namespace

std::vector<Texel> probe_sites(const LightTerms& light, const std::vector<std::size_t>& lights,
                               const Incidence& incidence)
{
    Sites sites(light.plane, 0);
    for (std::size_t i = 0; i < anywhere; ++i)
        sites.add(sites.anywhere());
    const Texel last{light.plane.height - 1, light.plane.width - 1};
    for (const Texel& corner : {Texel{0, 0}, Texel{0, last.x}, Texel{last.y, 0}, last}) {
        sites.add(corner);
        for (std::size_t i = 0; i < per_side / 2; ++i) {
            sites.add({corner.y, sites.below(light.plane.width)});
            sites.add({sites.below(light.plane.height), corner.x});
        }
    }

    std::vector<Texel> drawn;
    std::vector<float> sums(1, 0.0f);  // of changes
    std::size_t lit_sites = 0;
    for (std::size_t i = 0; i < pairs; ++i) {
        const Texel texel = sites.anywhere();
        const Texel other = sites.near(texel, pair_reach[i % pair_reach.size()]);
        const bool is_lit = std::any_of(lights.begin(), lights.end(), [&](std::size_t l) {
            return light.changing[l].irradiance(texel.y, texel.x) > 0.0f;
        });
        if (is_lit && lit_sites++ < lit)
            sites.add(texel);
        drawn.push_back(i % 2 == 0 ? texel : other);
        sums.push_back(sums.back() + change(light, lights, texel, other));
    }
    for (std::size_t i = 0; i < changing && sums.back() > 0.0f; ++i) {
        const float place = sums.back() * (static_cast<float>(i) + 0.5f) / static_cast<float>(changing);
        const auto above = std::upper_bound(sums.begin(), sums.end(), place);
        sites.add(drawn[std::min(static_cast<std::size_t>(above - sums.begin()), drawn.size()) - 1]);
    }
    std::vector<Texel> places;
    const auto add_place = [&](const Texel& place) {
        const auto is_near = [&](const Texel& other) {
            return std::max(place.y, other.y) - std::min(place.y, other.y) <= site_reach &&
                   std::max(place.x, other.x) - std::min(place.x, other.x) <= site_reach;
        };
        if (std::none_of(places.begin(), places.end(), is_near))
            places.push_back(place);
    };
    for (const std::size_t l : lights) {
        const Incidence::Extremes& extremes = incidence.extremes[l];
        if (extremes.irradiance == 0.0)
            continue;
        for (const Texel& place : {extremes.brightest, extremes.steepest, extremes.most_grazing})
            add_place(place);
        if (const std::optional<Texel> from = origin(light.plane, light.changing[l], drawn))
            add_place(*from);
    }
    for (const Texel& place : places)
        for (const std::size_t reach : extreme_reach)
            sites.add(sites.near(place, reach));
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
