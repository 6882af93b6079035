#include "transport/walk.h"

#include <cmath>

#include "base/vec.h"
#include "medium/fresnel.h"
#include "medium/henyey_greenstein.h"

namespace beamspread {

namespace {

// Exits less likely than this are tallied at random with this weight: unbiased, and the many deep
// flights that have next to no chance to leave cost one comparison.
constexpr double rare_exit = 0.02;

// A walk that outlives 2^k first_roulette / (1 - |g|) scatterings goes on with probability 1/sqrt(2) at each
// k. In a half-space the chance to be still inside falls like order^-1/2, so each octave of orders
// then costs the same, where it would double without.
constexpr double first_roulette = 32.0;
constexpr double roulette_survival = 0.70710678118654752;

Vec3 scatter(const Vec3& w, double g, Random& random)
{
    const double cos_theta = henyey_greenstein_sample(g, random.uniform());
    const double sin_theta = std::sqrt(std::max(0.0, 1.0 - cos_theta * cos_theta));
    // A uniform azimuth, as (a, b) / sqrt(s) of a point in the unit disk.
    double a, b, s;
    do {
        a = 2.0 * random.uniform() - 1.0;
        b = 2.0 * random.uniform() - 1.0;
        s = a * a + b * b;
    } while (s >= 1.0 || s == 0.0);
    const double scale = sin_theta / std::sqrt(s);
    // Orthonormal basis around w (Duff et al. 2017, JCGT 6(1)).
    const double sign = std::copysign(1.0, w.z);
    const double k = -1.0 / (sign + w.z);
    const double xy = w.x * w.y * k;
    const Vec3 tangent(1.0 + sign * w.x * w.x * k, sign * xy, -sign * w.x);
    const Vec3 bitangent(xy, sign + w.y * w.y * k, -w.y);
    const Vec3 out = tangent * (a * scale) + bitangent * (b * scale) + w * cos_theta;
    // One step of Newton's method keeps the length at 1 over a million scatterings.
    return out * (1.5 - 0.5 * glm::dot(out, out));
}

}  // namespace

void walk_photon(const Medium& medium, double theta_inside, Random& random, SideTallies& tallies)
{
    Vec3 x(0.0);
    Vec3 w(std::sin(theta_inside), 0.0, std::cos(theta_inside));  // z points into the medium
    double weight = 1.0;
    std::uint32_t order = 0;
    auto next_roulette = static_cast<std::uint32_t>(first_roulette / (1.0 - std::abs(medium.g)));

    while (true) {
        const bool up = w.z < 0.0;
        const bool can_exit = up || !medium.is_half_space();
        const double flight = -std::log(random.uniform_positive());
        // |w.z| from below, so that a flight along the surface has a finite, never reached end.
        const double to_boundary =
            can_exit ? (up ? x.z : medium.thickness - x.z) / std::max(std::abs(w.z), 1e-300) : 0.0;

        if (can_exit && order > 0) {
            double expected = std::exp(-to_boundary);
            if (expected < rare_exit)
                expected = random.uniform() * rare_exit < expected ? rare_exit : 0.0;
            if (expected > 0.0) {
                const double reflectance = fresnel(std::abs(w.z), 1.0 / medium.ior);
                if (reflectance < 1.0)
                    tallies[up ? 0 : 1].add(x.x + to_boundary * w.x, x.y + to_boundary * w.y, order,
                                            weight * expected * (1.0 - reflectance));
            }
        }
        if (can_exit && flight >= to_boundary) {
            // The part that leaves is tallied; the rest turns back.
            if (random.uniform() >= fresnel(std::abs(w.z), 1.0 / medium.ior))
                return;
            x += to_boundary * w;
            x.z = up ? 0.0 : medium.thickness;
            w.z = -w.z;
            continue;
        }
        x += flight * w;
        w = scatter(w, medium.g, random);
        if (++order >= max_order)
            return;
        if (order >= next_roulette) {
            if (random.uniform() >= roulette_survival)
                return;
            weight /= roulette_survival;
            next_roulette *= 2;
        }
    }
}

}  // namespace beamspread
