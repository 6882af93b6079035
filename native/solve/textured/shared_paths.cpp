#include "solve/textured/shared_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/constants.h"

namespace beamspread {

namespace {

// Scatterings after which a path counts as absorbed. Albedos up to .9999 have one path in 10^4 of more.
constexpr std::size_t max_scatterings = 100'000;

// Largest offset, texels; farther places count as there.
constexpr double max_offset = 1e6;

Vec3 scattered(const Vec3& w, double g, Random& random)
{
    const double cos_theta = henyey_greenstein_sample(g, random.uniform());
    const double sin_theta = std::sqrt(std::max(0.0, 1.0 - cos_theta * cos_theta));
    const double phi = 2.0 * pi * random.uniform();
    const Vec3 out = Frame(w).to_world({sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta});
    return glm::normalize(out);
}

// The places of one walk, mean free paths: the entry, the scatterings, and the exit. Empty if light does not leave through
// the face that counts. z points into the medium.
void walk(const WalkPlan& plan, Random& random, std::vector<Vec2>& places)
{
    const Medium& medium = plan.medium;
    const double sine = std::sqrt(std::max(0.0, 1.0 - plan.cos_theta * plan.cos_theta)) / medium.ior;
    Vec3 x(0.0);
    Vec3 w(sine, 0.0, std::sqrt(std::max(0.0, 1.0 - sine * sine)));
    places.assign(1, Vec2(0.0));
    for (std::size_t order = 0; order < max_scatterings;) {
        double ahead = std::numeric_limits<double>::infinity();
        if (w.z < 0.0)
            ahead = -x.z / w.z;
        else if (!medium.is_half_space() && w.z > 0.0)
            ahead = (medium.thickness - x.z) / w.z;
        const double flight = -std::log(random.uniform_positive());
        if (flight >= ahead) {
            x += ahead * w;
            x.z = w.z < 0.0 ? 0.0 : medium.thickness;
            if (random.uniform() < fresnel(std::min(std::abs(w.z), 1.0), 1.0 / medium.ior)) {
                w.z = -w.z;
                continue;
            }
            if ((w.z > 0.0) == plan.is_through)
                places.emplace_back(x);
            else
                places.clear();
            return;
        }
        x += flight * w;
        if (random.uniform() >= plan.survival)
            break;
        places.emplace_back(x);
        w = scattered(w, medium.g, random);
        ++order;
    }
    places.clear();
}

std::int32_t whole(double offset)
{
    return static_cast<std::int32_t>(std::floor(std::clamp(offset, -max_offset, max_offset)));
}

}  // namespace

Walks drawn_walks(const WalkPlan& plan, std::size_t count, Random& random)
{
    Walks walks;
    walks.count = count;
    std::vector<Vec2> places;
    for (std::size_t i = 0; i < count; ++i) {
        walk(plan, random, places);
        // Walks that end inside draw the point, too.
        const Vec2 within(random.uniform(), random.uniform());
        if (places.empty())
            continue;
        const Vec2 exit = places.back();
        places.pop_back();
        for (const Vec2& place : places)
            walks.places.push_back(place - exit);
        walks.within.push_back(within);
        walks.first.push_back(walks.places.size());
        walks.walk.push_back(i);
    }
    return walks;
}

Turn::Turn(const Vec3& travel, const std::array<double, 2>& texels_per_path)
{
    const double length = std::hypot(travel.x, travel.y);
    const Vec2 across = length > 0.0 ? Vec2(travel.x, travel.y) / length : Vec2(1.0, 0.0);
    right = texels_per_path[0] * Vec2(across.x, -across.y);
    up = texels_per_path[1] * Vec2(across.y, across.x);
}

PathPlace Turn::operator()(const Vec2& place, const Vec2& within) const
{
    return {whole(right.x * place.x + right.y * place.y + within.x), whole(up.x * place.x + up.y * place.y + within.y)};
}

}  // namespace beamspread
