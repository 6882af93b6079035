#include "transport/walk/walk.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/constants.h"
#include "base/vec.h"
#include "medium/medium.h"

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

// Unit vector at this angle from the z axis and a uniform azimuth.
Vec3 around_z(double cos_theta, Random& random)
{
    const double phi = 2.0 * pi * random.uniform();
    const double sin_theta = std::sqrt(std::max(0.0, 1.0 - cos_theta * cos_theta));
    return Vec3(sin_theta * std::cos(phi), sin_theta * std::sin(phi), cos_theta);
}

class Walk {
public:
    Walk(const Medium& medium, double theta_inside, Random& random, SideTallies& tallies)
        : m_medium(medium),
          m_random(random),
          m_tallies(tallies),
          m_plan(medium),
          m_w(std::sin(theta_inside), 0.0, std::cos(theta_inside)),
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
        const double to_boundary = distance_to_boundary(m_w);
        const double flight = -std::log(m_random.uniform_positive());
        if (m_order > 0)
            tally_expected(flight, to_boundary);
        m_exit_weight = 1.0;
        if (flight >= to_boundary)
            return reflect(to_boundary);
        const Vec3 before = m_w;
        scatter_after(flight);
        if (m_order <= m_plan.last_expected_order)
            tally_connections(before);
        return true;
    }

    // Makes one flight and tallies an actual exit. False if the photon left or lost the roulette.
    bool step_late()
    {
        const double to_boundary = distance_to_boundary(m_w);
        const double flight = -std::log(m_random.uniform_positive());
        if (flight >= to_boundary) {
            if (reflect(to_boundary))
                return true;
            // The random decision above accounts for Fresnel's transmittance; the tally must not.
            tally(m_w, to_boundary, 1.0);
            return false;
        }
        scatter_after(flight);
        return m_order < m_next_roulette || survive_roulette();
    }

    // Far from the boundary the flight's length decides at random whether its exit is tallied: it comes this close with
    // probability exp(-to_boundary) / rare_exit.
    void tally_expected(double flight, double to_boundary)
    {
        if (flight >= to_boundary - rare_exit_distance)
            tally_exit(m_w, to_boundary, m_exit_weight * std::exp(-std::min(to_boundary, rare_exit_distance)));
    }

    void scatter_after(double flight)
    {
        m_x += flight * m_w;
        m_w = scatter(m_w, m_medium.g, m_random);
        ++m_order;
    }

    // Reflects with the probability of Fresnel's reflectance. False if the photon leaves.
    bool reflect(double to_boundary)
    {
        if (m_random.uniform() >= fresnel(std::abs(m_w.z), 1.0 / m_medium.ior))
            return false;
        m_x += to_boundary * m_w;
        m_x.z = m_w.z < 0.0 ? 0.0 : m_medium.thickness;
        m_reflections = reflections_after(m_reflections, m_w.z > 0.0);
        m_w.z = -m_w.z;
        return true;
    }

    bool survive_roulette()
    {
        const double survival = m_order <= last_common_order ? roulette_survival : late_roulette_survival;
        if (m_order >= max_order || m_random.uniform() >= survival)
            return false;
        m_weight /= survival;
        m_next_roulette = std::min(2 * m_next_roulette, max_order);
        return true;
    }

    // Distance in mean free paths; infinite toward the far side of a half-space.
    double distance_to_boundary(const Vec3& w) const
    {
        const double depth = w.z < 0.0 ? m_x.z : m_medium.thickness - m_x.z;
        // The bound on |w.z| gives flights along the surface a finite end, which they never reach.
        return depth / std::max(std::abs(w.z), 1e-300);
    }

    // Tallies the expected value of an exit along w that happens with this probability.
    void tally_exit(const Vec3& w, double to_boundary, double probability)
    {
        const double reflectance = fresnel(std::abs(w.z), 1.0 / m_medium.ior);
        if (reflectance < 1.0)
            tally(w, to_boundary, probability * (1.0 - reflectance));
    }

    void tally(const Vec3& w, double to_boundary, double probability)
    {
        const Side side = w.z < 0.0 ? Side::reflected : Side::transmitted;
        m_tallies[static_cast<std::size_t>(side)].add(m_x.x + to_boundary * w.x, m_x.y + to_boundary * w.y, m_order,
                                                      pole_of(m_reflections, side), m_weight * probability);
    }

    // Density per steradian of sampled connections: proportional to the cosine, inside the cone that can leave.
    double connection_pdf(const Vec3& w) const
    {
        return w.z * w.z > 1.0 - m_plan.exit_cone ? std::abs(w.z) * inv_pi / m_plan.exit_cone : 0.0;
    }

    // Exits of low order have two sampling strategies: the phase function (the walk itself) and a connection, a
    // direction chosen inside the cone that can leave. The balance heuristic weights them (Veach, Guibas 1995,
    // doi:10.1145/218380.218498).
    void tally_connections(const Vec3& before)
    {
        const double phase = henyey_greenstein_pdf(glm::dot(before, m_w), m_medium.g);
        if (m_w.z < 0.0 || !m_medium.is_half_space())
            m_exit_weight = phase / (phase + connection_pdf(m_w));
        connect(before, -1.0);
        if (!m_medium.is_half_space())
            connect(before, 1.0);
    }

    // Samples one connection. From deep inside, where exp(-depth) is below rare_exit, only that fraction is sampled.
    void connect(const Vec3& before, double side)
    {
        const double depth = side < 0.0 ? m_x.z : m_medium.thickness - m_x.z;
        const double beyond = std::max(0.0, depth - rare_exit_distance);
        if (beyond > 0.0 && m_random.uniform() >= std::exp(-beyond))
            return;
        const double cos_theta = std::sqrt(1.0 - m_plan.exit_cone * m_random.uniform());
        const Vec3 w = around_z(side * cos_theta, m_random);
        const double phase = henyey_greenstein_pdf(glm::dot(before, w), m_medium.g);
        const double to_boundary = distance_to_boundary(w);
        double probability = phase / (phase + connection_pdf(w)) * std::exp(beyond - to_boundary);
        if (probability < rare_exit) {
            if (m_random.uniform() * rare_exit >= probability)
                return;
            probability = rare_exit;
        }
        tally_exit(w, to_boundary, probability);
    }

    const Medium& m_medium;
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

}  // namespace

void walk_scalar(const WalkJob& job)
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
                Walk(job.medium, job.theta_inside, random, tallies).run();
            done += block;
            job.progress.advance(static_cast<double>(block));
        }
        for (std::size_t side = 0; side < side_count; ++side)
            std::transform(tallies[side].weight.begin(), tallies[side].weight.end(), before[side].begin(),
                           job.weights[b][side].begin(), std::minus{});
    }
}

}  // namespace beamspread
