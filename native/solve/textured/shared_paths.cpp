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
void walk(const PathPlan& plan, Random& random, std::vector<Vec2>& places)
{
    const Medium& medium = plan.medium;
    const double sine = std::hypot(plan.travel.x, plan.travel.y) / medium.ior;
    const double length = std::hypot(plan.travel.x, plan.travel.y);
    const Vec2 across = length > 0.0 ? Vec2(plan.travel.x, plan.travel.y) / length : Vec2(1.0, 0.0);
    Vec3 x(0.0);
    Vec3 w(sine * across.x, sine * across.y, std::sqrt(std::max(0.0, 1.0 - sine * sine)));
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

void add_paths(SharedPaths& paths, const PathPlan& plan, std::size_t walks, Random& random)
{
    std::vector<Vec2> places;
    for (std::size_t i = 0; i < walks; ++i) {
        walk(plan, random, places);
        // The point of its texel that light leaves. Walks that end inside draw it, too.
        const Vec2 within(random.uniform(), random.uniform());
        if (places.empty())
            continue;
        const Vec2 exit = places.back();
        places.pop_back();
        for (const Vec2& place : places)
            paths.places.push_back({whole((place.x - exit.x) * plan.texels_per_path[0] + within.x),
                                    whole((place.y - exit.y) * plan.texels_per_path[1] + within.y)});
        paths.first.push_back(paths.places.size());
        paths.walk.push_back(i);
    }
}

}  // namespace beamspread
