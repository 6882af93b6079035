#include "transport/walk/walk.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/constants.h"
#include "base/vec.h"
#include "medium/medium.h"
#include "transport/walk/walk_shape.h"

namespace beamspread {

namespace {

Vec3 scatter(const Vec3& w, double g, Random& random)
{
    const double cos_theta = henyey_greenstein_sample(g, random.uniform());
    const double sin_theta = std::sqrt(std::max(0.0, 1.0 - cos_theta * cos_theta));
    // Sample a uniform azimuth as (a, b) / sqrt(s), with (a, b) uniform in the unit disk.
    double a, b, s;
    do {
        a = 2.0 * random.uniform() - 1.0;
        b = 2.0 * random.uniform() - 1.0;
        s = a * a + b * b;
    } while (s >= 1.0 || s == 0.0);
    const double scale = sin_theta / std::sqrt(s);
    const Vec3 out = Frame(w).to_world({a * scale, b * scale, cos_theta});
    // Renormalize by one step of Newton's method, which keeps the length at 1 over a million scatterings.
    return out * (1.5 - 0.5 * glm::dot(out, out));
}

// `Shape` is FlatShape or RoundShape.
template <class Shape>
class Walk {
public:
    Walk(const WalkJob& job, Random& random, SideTallies& tallies)
        : m_medium(job.medium),
          m_shape(job.medium, job.curvature),
          m_random(random),
          m_tallies(tallies),
          m_plan(job.medium, job.curvature),
          m_w(std::sin(job.theta_inside), 0.0, std::cos(job.theta_inside)),
          m_next_roulette(m_plan.first_roulette)
    {
    }

    void run()
    {
        while (m_order <= m_plan.last_expected_order)
            if (!step_early())
                return;
        m_weight /= late_walks;
        const Walk start = *this;
        for (std::size_t i = 0; i < late_walks; ++i) {
            Walk walk = start;
            while (walk.step_late()) {
            }
        }
    }

private:
    // Makes one flight, tallies its expected exit, and scatters or reflects at its end. False if the photon left.
    bool step_early()
    {
        const Ahead ahead = m_shape.ahead(m_x, m_w);
        const double flight = -std::log(m_random.uniform_positive());
        if (m_order > 0)
            tally_expected(flight, ahead);
        m_exit_weight = 1.0;
        if (flight >= ahead.distance)
            return reflect(ahead);
        const Vec3 before = m_w;
        scatter_after(flight);
        if (m_order <= m_plan.last_expected_order)
            tally_connections(before);
        return true;
    }

    // Makes one flight and tallies an actual exit. False if the photon left or lost the roulette.
    bool step_late()
    {
        const Ahead ahead = m_shape.ahead(m_x, m_w);
        const double flight = -std::log(m_random.uniform_positive());
        if (flight >= ahead.distance) {
            if (reflect(ahead))
                return true;
            // The random decision above accounts for Fresnel's transmittance; the tally must not.
            tally(m_w, ahead.distance, 1.0);
            return false;
        }
        scatter_after(flight);
        return m_order < m_next_roulette || survive_roulette();
    }

    // Far from the boundary the flight's length decides at random whether its exit is tallied: it comes this close with
    // probability exp(-distance) / rare_exit.
    void tally_expected(double flight, const Ahead& ahead)
    {
        if (flight >= ahead.distance - rare_exit_distance)
            tally_exit(m_w, ahead, m_exit_weight * std::exp(-std::min(ahead.distance, rare_exit_distance)));
    }

    void scatter_after(double flight)
    {
        m_x += flight * m_w;
        m_w = scatter(m_w, m_medium.g, m_random);
        ++m_order;
    }

    // Reflects with the probability of Fresnel's reflectance. False if the photon leaves.
    bool reflect(const Ahead& ahead)
    {
        if (m_random.uniform() >= fresnel(ahead.cosine, 1.0 / m_medium.ior))
            return false;
        m_x += ahead.distance * m_w;
        m_reflections = reflections_after(m_reflections, m_w.z > 0.0);
        m_shape.reflect(m_x, m_w);
        return true;
    }

    bool survive_roulette()
    {
        const double survival = m_order <= m_plan.last_common_order ? roulette_survival : late_roulette_survival;
        if (m_order >= max_order || m_random.uniform() >= survival)
            return false;
        m_weight /= survival;
        m_next_roulette = std::min(2 * m_next_roulette, max_order);
        return true;
    }

    // Tallies the expected value of an exit along w that happens with this probability.
    void tally_exit(const Vec3& w, const Ahead& ahead, double probability)
    {
        const double reflectance = fresnel(ahead.cosine, 1.0 / m_medium.ior);
        if (reflectance < 1.0)
            tally(w, ahead.distance, probability * (1.0 - reflectance));
    }

    void tally(const Vec3& w, double distance, double probability)
    {
        const Side side = m_shape.side_ahead(w);
        const Vec2 exit = m_shape.exit(m_x, w, distance);
        m_tallies[static_cast<std::size_t>(side)].add(exit.x, exit.y, m_order, pole_of(m_reflections, side),
                                                      m_weight * probability);
    }

    // Exits of low order have two sampling strategies: the phase function (the walk itself) and a connection, a
    // direction chosen inside the cone that can leave. The balance heuristic weights them (Veach, Guibas 1995,
    // doi:10.1145/218380.218498).
    void tally_connections(const Vec3& before)
    {
        const double phase = henyey_greenstein_pdf(glm::dot(before, m_w), m_medium.g);
        const typename Shape::Cones cones = m_shape.cones(m_x, m_plan.exit_cone);
        m_exit_weight = phase / (phase + cones.pdf(m_w));
        connect(before, cones, -1.0);
        if (!m_medium.is_half_space())
            connect(before, cones, 1.0);
    }

    // Samples one connection. From deep inside, where exp(-depth) is below rare_exit, only that fraction is sampled.
    void connect(const Vec3& before, const typename Shape::Cones& cones, double side)
    {
        const double depth = m_shape.depth(m_x, side);
        const double beyond = std::max(0.0, depth - rare_exit_distance);
        if (beyond > 0.0 && m_random.uniform() >= std::exp(-beyond))
            return;
        const Vec3 w = cones.sample(side, m_random);
        const double phase = henyey_greenstein_pdf(glm::dot(before, w), m_medium.g);
        const Ahead ahead = m_shape.ahead(m_x, w);
        double probability = phase / (phase + cones.pdf(w)) * std::exp(beyond - ahead.distance);
        if (probability < rare_exit) {
            if (m_random.uniform() * rare_exit >= probability)
                return;
            probability = rare_exit;
        }
        tally_exit(w, ahead, probability);
    }

    const Medium& m_medium;
    Shape m_shape;
    Random& m_random;
    SideTallies& m_tallies;
    WalkPlan m_plan;
    Vec3 m_x{0.0};  // mean free paths; z points into the medium
    Vec3 m_w;
    double m_weight = 1.0;
    double m_exit_weight = 1.0;  // balance heuristic of the exit along the walk
    std::uint32_t m_order = 0;
    std::uint32_t m_reflections = 0;  // see transport/tally/tally.h
    std::uint32_t m_next_roulette;
};

template <class Shape>
void walk(const WalkJob& job)
{
    for (std::size_t b = 0; b < job.photons.size(); ++b) {
        Random random(job.seed, job.stream, job.first_batch + b);
        SideTallies& tallies = job.tallies[b / job.batches_per_tally];
        SideWeights before;
        for (std::size_t side = 0; side < side_count; ++side)
            before[side] = tallies[side].weight;
        for (std::uint64_t done = 0; done < job.photons[b];) {
            const std::uint64_t block = std::min(photons_per_progress, job.photons[b] - done);
            for (std::uint64_t i = 0; i < block; ++i)
                Walk<Shape>(job, random, tallies).run();
            done += block;
            job.progress.advance(static_cast<double>(block));
        }
        for (std::size_t side = 0; side < side_count; ++side)
            std::transform(tallies[side].weight.begin(), tallies[side].weight.end(), before[side].begin(),
                           job.weights[b][side].begin(), std::minus{});
    }
}

}  // namespace

void walk_scalar(const WalkJob& job)
{
    if (job.curvature == 0.0)
        walk<FlatShape>(job);
    else
        walk<RoundShape>(job);
}

}  // namespace beamspread
