// The photon walk of walk.cpp with one photon in each vector lane. The photons of a vector start together and make
// their early flights, which tally expected exits. Survivors join a pool, which fills the vectors for later flights.
// The oldest instruction set runs the scalar walk.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transport/walk/walk_packets.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "hwy/contrib/math/math-inl.h"
#include "transport/walk/packet_flight-inl.h"
#include "transport/walk/packet_math-inl.h"
#include "transport/walk/packet_shape-inl.h"
#include "transport/walk/packet_tally-inl.h"
#include "transport/walk/walk.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// Flights between two compactions of the pool. More: fewer compactions, more idle lanes.
constexpr int flights_per_sweep = 4;

// `Shape` is FlatPacketShape or RoundPacketShape.
template <class Shape>
class PacketWalk {
public:
    explicit PacketWalk(const WalkJob& job)
        : m_job(job),
          m_medium(job.medium),
          m_plan(job.medium, job.curvature),
          m_shape(job.medium, job.curvature, m_plan.exit_cone),
          m_tally(job)
    {
        Random random(job.seed, job.stream, job.first_batch);
        PacketRandom::seed(random, m_random);
    }

    void run()
    {
        bool more = true;
        while (more) {
            while (more && m_pool.count() + late_walks * lane_count <= PhotonPool::capacity) {
                more = next_batch();
                if (more)
                    walk_early();
            }
            walk_late();
        }
        while (m_pool.count() > 0)
            walk_late();
        m_tally.finish();
        m_job.progress.advance(static_cast<double>(m_unreported));
    }

private:
    using Flight = typename Shape::Flight;
    using Cones = typename Shape::Cones;

    // Moves to the next batch with photons left to start. True if there is one.
    bool next_batch()
    {
        while (m_batch < m_job.photons.size() && m_started == m_job.photons[m_batch]) {
            ++m_batch;
            m_started = 0;
        }
        return m_batch < m_job.photons.size();
    }

    // Starts one vector of the batch's photons.
    HWY_INLINE FloatMask start(Photons& photons)
    {
        const std::uint64_t left = m_job.photons[m_batch] - m_started;
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left, lane_count));
        m_started += count;
        m_unreported += count;
        if (m_unreported >= photons_per_progress) {
            m_job.progress.advance(static_cast<double>(m_unreported));
            m_unreported = 0;
        }
        const Floats zero = hn::Zero(floats);
        photons = {{zero, zero, zero},
                   {broadcast(std::sin(m_job.theta_inside)), zero, broadcast(std::cos(m_job.theta_inside))},
                   broadcast(1.0),
                   hn::Zero(words),
                   hn::Set(words, m_plan.first_roulette),
                   hn::Set(words, static_cast<std::uint32_t>(m_batch << batch_shift))};
        return hn::FirstN(floats, count);
    }

    // Walks one vector from the entry to the scattering after `last_expected_order`.
    HWY_NOINLINE void walk_early()
    {
        Photons photons;
        FloatMask active = start(photons);
        PacketRandom random(m_random);
        Floats exit_weight = broadcast(1.0);  // balance heuristic of the exit along the walk
        while (!hn::AllFalse(floats, active)) {
            const Photons from = photons;
            const Flight flight = m_shape.fly(from, random);
            const Floats to_boundary = flight.to_boundary();
            const Floats reflectance = m_medium.boundary.reflectance(flight.cosine);
            tally_expected(hn::And(hn::And(active, flight.comes_close()), greater(from.order, hn::Zero(words))), from,
                           to_boundary, reflectance, exit_weight);

            const Deflection deflection = m_medium.phase.sample(random.uniform());
            scatter(photons, flight, deflection, random);
            const FloatMask is_reflected = hn::And(flight.hits, hn::Lt(random.uniform(), reflectance));
            m_shape.reflect(photons, is_reflected, from, to_boundary);
            active = hn::And(active, hn::Or(hn::Not(flight.hits), is_reflected));

            const FloatMask late = greater(photons.order, hn::Set(words, m_plan.last_expected_order));
            const FloatMask connected = hn::AndNot(hn::Or(flight.hits, late), active);
            exit_weight = broadcast(1.0);
            if (!hn::AllFalse(floats, connected)) {
                const Cones cones = m_shape.cones(photons.x);
                const FloatMask rivalled = hn::And(connected, cones.rivals(photons.w));
                const Floats balanced = hn::Div(deflection.pdf, hn::Add(deflection.pdf, cones.pdf(photons.w)));
                exit_weight = hn::IfThenElse(rivalled, balanced, exit_weight);
                connect(connected, photons, from.w, cones, -1.0, random);
                if (!m_medium.is_half_space)
                    connect(connected, photons, from.w, cones, 1.0, random);
            }
            if (const FloatMask leaving = hn::And(active, late); !hn::AllFalse(floats, leaving)) {
                photons.weight = hn::Mul(photons.weight, broadcast(1.0 / late_walks));
                for (std::size_t copy = 0; copy < late_walks; ++copy)
                    m_pool.append(leaving, photons);
                photons.weight = hn::Mul(photons.weight, broadcast(late_walks));
                active = hn::AndNot(leaving, active);
            }
        }
        random.store();
    }

    // Makes `flights_per_sweep` flights of all photons in the pool.
    HWY_NOINLINE void walk_late()
    {
        PacketRandom random(m_random);
        const std::size_t count = m_pool.count();
        m_pool.clear();
        for (std::size_t first = 0; first < count; first += lane_count) {
            FloatMask active = hn::FirstN(floats, count - first);
            Photons photons = m_pool.load(first);
            for (int i = 0; i < flights_per_sweep; ++i)
                active = step(photons, active, random);
            photons.w = renormalized(photons.w);
            m_pool.append(active, photons);
        }
        random.store();
    }

    // Makes one flight, then scatters or reflects at its end. Returns the photons that continue.
    HWY_INLINE FloatMask step(Photons& photons, FloatMask active, PacketRandom& random)
    {
        const Photons from = photons;
        const Flight flight = m_shape.fly(from, random);
        scatter(photons, flight, m_medium.phase.sample(random.uniform()), random);
        if (const FloatMask hits = hn::And(active, flight.hits); !hn::AllFalse(floats, hits)) {
            const Floats to_boundary = flight.to_boundary();
            const FloatMask is_reflected =
                hn::And(hits, hn::Lt(random.uniform(), m_medium.boundary.reflectance(flight.cosine)));
            m_shape.reflect(photons, is_reflected, from, to_boundary);
            // The random decision above accounts for Fresnel's transmittance; the tally must not.
            const FloatMask leaves = hn::AndNot(is_reflected, hits);
            tally(leaves, from, from.w, to_boundary, from.weight);
            active = hn::AndNot(leaves, active);
        }
        const FloatMask at_risk = hn::AndNot(greater(photons.next_roulette, photons.order), active);
        if (!hn::AllFalse(floats, at_risk))
            active = hn::And(active, play_roulette(photons, at_risk, random));
        return active;
    }

    // Returns the survivors.
    HWY_INLINE FloatMask play_roulette(Photons& photons, FloatMask at_risk, PacketRandom& random) const
    {
        const FloatMask late = greater(photons.order, hn::Set(words, m_plan.last_common_order));
        const Floats survival = hn::IfThenElse(late, broadcast(late_roulette_survival), broadcast(roulette_survival));
        photons.weight = hn::IfThenElse(at_risk, hn::Div(photons.weight, survival), photons.weight);
        const Words next = hn::Min(hn::Add(photons.next_roulette, photons.next_roulette), hn::Set(words, max_order));
        photons.next_roulette = hn::IfThenElse(hn::RebindMask(words, at_risk), next, photons.next_roulette);
        const FloatMask ends =
            hn::Or(hn::Ge(random.uniform(), survival), greater(photons.order, hn::Set(words, max_order - 1)));
        return hn::Not(hn::And(at_risk, ends));
    }

    HWY_INLINE void tally(FloatMask mask, const Photons& from, const Vectors& w, Floats to_boundary, Floats weight)
    {
        const Exit exit = m_shape.exit(from.x, w, to_boundary);
        m_tally.add(mask, exit.u, exit.v, weight, hn::Or(hn::Or(from.order, from.batch), exit.side));
    }

    // Tallies the expected exits of flights that begin at `from`.
    HWY_INLINE void tally_expected(FloatMask close, const Photons& from, Floats to_boundary, Floats reflectance,
                                   Floats exit_weight)
    {
        const FloatMask tallied = hn::And(close, hn::Lt(reflectance, broadcast(1.0)));
        if (hn::AllFalse(floats, tallied))
            return;
        const Floats escape = hn::Exp(floats, hn::Neg(hn::Min(to_boundary, broadcast(rare_exit_distance))));
        const Floats transmittance = hn::Sub(broadcast(1.0), reflectance);
        tally(tallied, from, from.w, to_boundary,
              hn::Mul(hn::Mul(from.weight, transmittance), hn::Mul(escape, exit_weight)));
    }

    // Samples one connection per photon: see Walk::connect.
    HWY_INLINE void connect(FloatMask mask, const Photons& at, const Vectors& before, const Cones& cones, double side,
                            PacketRandom& random)
    {
        const Floats depth = m_shape.depth(at.x, side);
        const Floats beyond = hn::Max(hn::Sub(depth, broadcast(rare_exit_distance)), hn::Zero(floats));
        const FloatMask chosen = hn::And(mask, hn::Lt(random.uniform(), hn::Exp(floats, hn::Neg(beyond))));
        if (hn::AllFalse(floats, chosen))
            return;
        const Connection to = cones.sample(m_shape, at.x, depth, side, random);
        const Floats phase = m_medium.phase.pdf(dot(before, to.w));
        const Floats balanced = hn::Div(phase, hn::Add(phase, cones.pdf(to.w)));
        const Floats probability = hn::Mul(balanced, hn::Exp(floats, hn::Sub(beyond, to.distance)));
        const Floats rare = broadcast(rare_exit);
        const FloatMask tallied = hn::And(chosen, hn::Lt(hn::Mul(random.uniform(), rare), probability));
        const Floats transmittance = hn::Sub(broadcast(1.0), m_medium.boundary.reflectance(to.cosine));
        tally(tallied, at, to.w, to.distance, hn::Mul(hn::Mul(at.weight, transmittance), hn::Max(probability, rare)));
    }

    const WalkJob& m_job;
    PacketMedium m_medium;
    WalkPlan m_plan;
    Shape m_shape;
    PacketTally m_tally;
    PhotonPool m_pool;
    RandomState m_random{};
    std::size_t m_batch = 0;
    std::uint64_t m_started = 0;  // photons of the batch
    std::uint64_t m_unreported = 0;  // started photons
};

void walk_packets(const WalkJob& job)
{
    if (job.curvature == 0.0)
        PacketWalk<FlatPacketShape>(job).run();
    else
        PacketWalk<RoundPacketShape>(job).run();
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

std::vector<WalkKernel> walk_kernels()
{
    std::vector<WalkKernel> kernels;
    [[maybe_unused]] const std::int64_t supported = hwy::SupportedTargets();
#if HWY_TARGETS & HWY_AVX3
    if (supported & HWY_AVX3)
        kernels.push_back({"avx512", N_AVX3::walk_packets});
#endif
#if HWY_TARGETS & HWY_AVX2
    if (supported & HWY_AVX2)
        kernels.push_back({"avx2", N_AVX2::walk_packets});
#endif
#if HWY_TARGETS & HWY_SSE4
    if (supported & HWY_SSE4)
        kernels.push_back({"sse4", N_SSE4::walk_packets});
#endif
    kernels.push_back({"scalar", walk_scalar});
    return kernels;
}

}  // namespace beamspread
#endif
