// The photon walk of walk.cpp for many photons at a time: every lane of a vector is a photon, and a lane whose
// photon has ended takes the next one. What only some lanes need (exits, connections) is queued until vectors are full.
// The oldest instruction set runs the scalar walk.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transport/walk_packets.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "hwy/contrib/math/math-inl.h"
#include "medium/fresnel.h"
#include "transport/packet_math-inl.h"
#include "transport/packet_tally-inl.h"
#include "transport/walk_plan.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

constexpr std::size_t packet_count = 2;

template <class T>
using Lanes = std::array<T, lane_count>;

// A photon in every lane.
struct Photons {
    Vectors x;  // mean free paths; z points into the medium
    Vectors w;
    Floats weight;
    Floats exit_weight;  // of the exit along the walk, among the ways to sample it
    Words order;
    Words next_roulette;
    Words batch;  // shifted into place
};

struct Packet {
    HWY_INLINE Photons load() const
    {
        const auto at = [&](std::size_t i) { return hn::Load(floats, numbers[i].data()); };
        const auto word = [&](std::size_t i) { return hn::Load(words, counts[i].data()); };
        return {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}, at(6), at(7), word(0), word(1), word(2)};
    }

    HWY_INLINE void store(const Photons& photons)
    {
        std::size_t i = 0;
        for (const Floats value : {photons.x.x, photons.x.y, photons.x.z, photons.w.x, photons.w.y, photons.w.z,
                                   photons.weight, photons.exit_weight})
            hn::Store(value, floats, numbers[i++].data());
        i = 0;
        for (const Words value : {photons.order, photons.next_roulette, photons.batch})
            hn::Store(value, words, counts[i++].data());
    }

    HWY_ALIGN std::array<Lanes<float>, 8> numbers{};
    HWY_ALIGN std::array<Lanes<std::uint32_t>, 3> counts{};
    HWY_ALIGN Lanes<std::uint32_t> active{};  // all bits, or none: nobody is left to walk
    RandomState random{};
    std::size_t active_count = lane_count;
};

class PacketWalk {
public:
    explicit PacketWalk(const WalkJob& job)
        : m_job(job),
          m_plan(job.medium),
          m_half_space(job.medium.is_half_space()),
          m_thickness(broadcast(job.medium.thickness)),
          m_sin_theta(static_cast<float>(std::sin(job.theta_inside))),
          m_cos_theta(static_cast<float>(std::cos(job.theta_inside))),
          m_tally(job.tallies)
    {
    }

    void run()
    {
        Random random(m_job.seed, m_job.stream, m_job.first_batch);
        for (Packet& packet : m_packets) {
            PacketRandom::seed(random, packet.random);
            packet.active.fill(~0u);
            Photons photons = packet.load();
            start_photons(packet, hn::FirstN(floats, lane_count), photons);
            packet.store(photons);
        }
        PacketRandom::seed(random, m_connection_random);
        bool alive = true;
        while (alive) {
            alive = false;
            for (Packet& packet : m_packets) {
                if (packet.active_count == 0)
                    continue;
                step(packet);
                alive = true;
            }
        }
        connect_all();
        m_tally.finish();
        m_job.progress.advance(static_cast<double>(m_unreported));
    }

private:
    // The next photons of the job into these lanes.
    HWY_INLINE void start_photons(Packet& packet, FloatMask lanes, Photons& photons)
    {
        const auto start = [lanes](Floats& value, float at) {
            value = hn::IfThenElse(lanes, hn::Set(floats, at), value);
        };
        start(photons.x.x, 0.0f);
        start(photons.x.y, 0.0f);
        start(photons.x.z, 0.0f);
        start(photons.w.x, m_sin_theta);
        start(photons.w.y, 0.0f);
        start(photons.w.z, m_cos_theta);
        start(photons.weight, 1.0f);
        start(photons.exit_weight, 1.0f);
        const auto started = hn::RebindMask(words, lanes);
        photons.order = hn::IfThenZeroElse(started, photons.order);
        photons.next_roulette =
            hn::IfThenElse(started, hn::Set(words, m_plan.first_roulette), photons.next_roulette);
        const std::size_t count = hn::CountTrue(floats, lanes);
        if (count <= m_left_in_batch) {
            m_left_in_batch -= count;
            report(count);
            photons.batch = hn::IfThenElse(started, hn::Set(words, m_batch_word), photons.batch);
        } else {
            photons.batch = start_next_batches(packet, lanes, photons.batch);
        }
    }

    // Batches of these lanes where the current one has too few photons left for them; those that none has are idle.
    HWY_NOINLINE Words start_next_batches(Packet& packet, FloatMask lanes, Words batch)
    {
        HWY_ALIGN Lanes<std::uint32_t> batches;
        hn::Store(batch, words, batches.data());
        std::array<std::uint8_t, 8> bytes{};
        hn::StoreMaskBits(floats, lanes, bytes.data());
        for (auto bits = std::bit_cast<std::uint64_t>(bytes); bits != 0; bits &= bits - 1) {
            const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
            while (m_left_in_batch == 0 && m_next_batch < m_job.photons.size()) {
                m_batch_word = static_cast<std::uint32_t>(m_next_batch << batch_shift);
                m_left_in_batch = m_job.photons[m_next_batch++];
            }
            if (m_left_in_batch == 0) {
                packet.active[lane] = 0;
                --packet.active_count;
                continue;
            }
            --m_left_in_batch;
            report(1);
            batches[lane] = m_batch_word;
        }
        return hn::Load(words, batches.data());
    }

    HWY_INLINE void report(std::size_t started)
    {
        m_unreported += started;
        if (m_unreported >= photons_per_progress) {
            m_job.progress.advance(static_cast<double>(m_unreported));
            m_unreported = 0;
        }
    }

    HWY_INLINE Floats distance_to_boundary(Floats z, Floats wz) const
    {
        const FloatMask up = hn::Lt(wz, hn::Zero(floats));
        const Floats depth = hn::IfThenElse(up, z, hn::Sub(m_thickness, z));
        // |wz| from below: a flight along the surface has a finite end that it never reaches.
        return hn::Div(depth, hn::Max(hn::Abs(wz), broadcast(1e-30)));
    }

    // One flight, and the scattering or reflection at its end.
    HWY_INLINE void step(Packet& packet)
    {
        PacketRandom random(packet.random);
        const double g = m_job.medium.g;
        const FloatMask active = float_mask(hn::Ne(hn::Load(words, packet.active.data()), hn::Zero(words)));
        Photons photons = packet.load();
        Vectors& x = photons.x;
        const Vectors w = photons.w;

        const Floats to_boundary = distance_to_boundary(x.z, w.z);
        const Floats flight = hn::Neg(hn::Log(floats, random.uniform()));
        const FloatMask hits = hn::Ge(flight, to_boundary);
        const Floats reflectance = internal_reflectance(m_job.medium.ior, hn::Abs(w.z));
        // The part that leaves is tallied; the rest turns back.
        const FloatMask turns_back = hn::And(hits, hn::Lt(random.uniform(), reflectance));
        FloatMask ends = hn::AndNot(turns_back, hits);
        tally_exits(photons, active, to_boundary, flight, reflectance, ends);
        const FloatMask scatters = hn::Not(hits);
        const Floats path = hn::Min(flight, to_boundary);
        x = {hn::MulAdd(path, w.x, x.x), hn::MulAdd(path, w.y, x.y), hn::MulAdd(path, w.z, x.z)};
        const FloatMask up = hn::Lt(w.z, hn::Zero(floats));
        x.z = hn::IfThenElse(hits, hn::IfThenElse(up, hn::Zero(floats), m_thickness), x.z);

        const Deflection deflection = sample_henyey_greenstein(g, random.uniform());
        const Vectors scattered = turn(w, deflection.cos_theta, deflection.sin_theta, random_azimuth(random));
        Words& order = photons.order;
        order = hn::IfThenElse(hn::RebindMask(words, scatters), hn::Add(order, hn::Set(words, 1u)), order);

        photons.exit_weight = broadcast(1.0);
        const FloatMask connected =
            hn::AndNot(greater(order, hn::Set(words, m_plan.last_expected_order)), hn::And(scatters, active));
        if (!hn::AllFalse(floats, connected)) {
            const Floats balanced = hn::Div(deflection.pdf, hn::Add(deflection.pdf, connection_pdf(scattered.z)));
            const FloatMask rivalled =
                m_half_space ? hn::And(connected, hn::Lt(scattered.z, hn::Zero(floats))) : connected;
            photons.exit_weight = hn::IfThenElse(rivalled, balanced, photons.exit_weight);
            m_requests.push(connected, x, w, photons.weight, hn::Or(order, photons.batch));
            if (m_requests.count > Requests::capacity)
                connect_all();
        }

        ends = hn::Or(ends, greater(order, hn::Set(words, max_order - 1)));
        const FloatMask at_risk = hn::AndNot(greater(photons.next_roulette, order), scatters);
        if (!hn::AllFalse(floats, at_risk)) {
            const FloatMask late = greater(order, hn::Set(words, last_common_order));
            const Floats survival =
                hn::IfThenElse(late, broadcast(late_roulette_survival), broadcast(roulette_survival));
            ends = hn::Or(ends, hn::And(at_risk, hn::Ge(random.uniform(), survival)));
            photons.weight = hn::IfThenElse(at_risk, hn::Div(photons.weight, survival), photons.weight);
            photons.next_roulette = hn::Add(photons.next_roulette,
                                            hn::IfThenElseZero(hn::RebindMask(words, at_risk), photons.next_roulette));
        }

        photons.w = {hn::IfThenElse(scatters, scattered.x, w.x), hn::IfThenElse(scatters, scattered.y, w.y),
                     hn::IfThenElse(scatters, scattered.z, hn::Neg(w.z))};
        ends = hn::And(ends, active);
        if (!hn::AllFalse(floats, ends))
            start_photons(packet, ends, photons);
        packet.store(photons);
        random.store();
    }

    // Low orders: the exits along the flights that begin here, instead of waiting for one. Far from the boundary the
    // flight itself decides whether its exit is tallied: it comes this close with the probability exp(-to_boundary) /
    // rare_exit. High orders: the exits that happen.
    HWY_INLINE void tally_exits(const Photons& photons, FloatMask active, Floats to_boundary, Floats flight,
                                Floats reflectance, FloatMask leaves)
    {
        const Words order = photons.order;
        const Floats rare_distance = broadcast(rare_exit_distance);
        const FloatMask late = greater(order, hn::Set(words, m_plan.last_expected_order));
        const FloatMask close =
            hn::Or(hn::Lt(to_boundary, rare_distance), hn::Ge(flight, hn::Sub(to_boundary, rare_distance)));
        const FloatMask scattered = greater(order, hn::Zero(words));
        const FloatMask may_leave = hn::And(hn::And(close, scattered), hn::Lt(reflectance, broadcast(1.0)));
        const FloatMask tallied = hn::And(active, hn::Or(hn::And(late, leaves), hn::AndNot(late, may_leave)));
        if (hn::AllFalse(floats, tallied))
            return;
        const Floats escape = hn::Mul(hn::Exp(floats, hn::Neg(hn::Min(to_boundary, rare_distance))),
                                      photons.exit_weight);
        const Floats probability =
            hn::IfThenElse(late, broadcast(1.0), hn::Mul(escape, hn::Sub(broadcast(1.0), reflectance)));
        add_exits(tallied, photons.x, photons.w, to_boundary, hn::Mul(photons.weight, probability),
                  hn::Or(order, photons.batch));
    }

    HWY_INLINE void add_exits(FloatMask mask, const Vectors& x, const Vectors& w, Floats to_boundary, Floats weight,
                              Words what)
    {
        const FloatMask up = hn::Lt(w.z, hn::Zero(floats));
        const Words side = hn::IfThenElse(hn::RebindMask(words, up), hn::Zero(words), hn::Set(words, 1u << side_shift));
        m_tally.add(mask, hn::MulAdd(to_boundary, w.x, x.x), hn::MulAdd(to_boundary, w.y, x.y), weight,
                    hn::Or(what, side));
    }

    // Density per steradian of the connections below: proportional to the cosine, inside the cone that
    // internal reflection lets out.
    HWY_INLINE Floats connection_pdf(Floats wz) const
    {
        const FloatMask inside = hn::Gt(hn::Mul(wz, wz), broadcast(1.0 - m_plan.exit_cone));
        return hn::IfThenElseZero(inside, hn::Mul(hn::Abs(wz), broadcast(inv_pi / m_plan.exit_cone)));
    }

    // Scatterings from which an exit is to be sampled by a direction that leaves: see Walk::tally_connections.
    struct Requests {
        static constexpr std::size_t capacity = 128;
        template <class T>
        using Queue = std::array<T, capacity + 2 * lane_count>;

        HWY_INLINE void push(FloatMask mask, const Vectors& from, const Vectors& before, Floats w, Words order_batch)
        {
            store_compressed(mask, floats, from.x, x.data() + count);
            store_compressed(mask, floats, from.y, y.data() + count);
            store_compressed(mask, floats, from.z, z.data() + count);
            store_compressed(mask, floats, before.x, wx.data() + count);
            store_compressed(mask, floats, before.y, wy.data() + count);
            store_compressed(mask, floats, before.z, wz.data() + count);
            store_compressed(mask, floats, w, weight.data() + count);
            count += store_compressed(mask, words, order_batch, what.data() + count);
        }

        std::size_t count = 0;
        Queue<float> x{};
        Queue<float> y{};
        Queue<float> z{};
        Queue<float> wx{};
        Queue<float> wy{};
        Queue<float> wz{};
        Queue<float> weight{};
        Queue<std::uint32_t> what{};
    };

    HWY_NOINLINE void connect_all()
    {
        PacketRandom random(m_connection_random);
        for (std::size_t i = 0; i < m_requests.count; i += lane_count) {
            const FloatMask valid = hn::FirstN(floats, m_requests.count - i);
            connect(valid, i, -1.0, random);
            if (!m_half_space)
                connect(valid, i, 1.0, random);
        }
        random.store();
        m_requests.count = 0;
    }

    HWY_INLINE void connect(FloatMask valid, std::size_t i, double side, PacketRandom& random)
    {
        const Vectors x{hn::LoadU(floats, m_requests.x.data() + i), hn::LoadU(floats, m_requests.y.data() + i),
                        hn::LoadU(floats, m_requests.z.data() + i)};
        const Vectors before{hn::LoadU(floats, m_requests.wx.data() + i), hn::LoadU(floats, m_requests.wy.data() + i),
                             hn::LoadU(floats, m_requests.wz.data() + i)};
        const Floats sin2 = hn::Mul(broadcast(m_plan.exit_cone), random.uniform());
        const Floats cos_theta = hn::Sqrt(hn::Sub(broadcast(1.0), sin2));
        const Floats sin_theta = hn::Sqrt(sin2);
        const SinCos azimuth = random_azimuth(random);
        const Vectors w{hn::Mul(sin_theta, azimuth.cosine), hn::Mul(sin_theta, azimuth.sine),
                        hn::Mul(broadcast(side), cos_theta)};
        const Floats phase = henyey_greenstein_density(m_job.medium.g, dot(before, w));
        const Floats to_boundary = distance_to_boundary(x.z, w.z);
        const Floats balanced = hn::Div(phase, hn::Add(phase, connection_pdf(w.z)));
        const Floats probability = hn::Mul(balanced, hn::Exp(floats, hn::Neg(to_boundary)));
        const Floats rare = broadcast(rare_exit);
        const FloatMask tallied = hn::And(valid, hn::Lt(hn::Mul(random.uniform(), rare), probability));
        const Floats weight = hn::Mul(hn::LoadU(floats, m_requests.weight.data() + i), hn::Max(probability, rare));
        const Floats transmittance = hn::Sub(broadcast(1.0), internal_reflectance(m_job.medium.ior, cos_theta));
        add_exits(tallied, x, w, to_boundary, hn::Mul(weight, transmittance),
                  hn::LoadU(words, m_requests.what.data() + i));
    }

    const WalkJob& m_job;
    WalkPlan m_plan;
    bool m_half_space;
    Floats m_thickness;
    float m_sin_theta;
    float m_cos_theta;
    PacketTally m_tally;
    std::array<Packet, packet_count> m_packets{};
    Requests m_requests;
    RandomState m_connection_random{};
    std::uint32_t m_batch_word = 0;
    std::size_t m_next_batch = 0;
    std::uint64_t m_left_in_batch = 0;
    std::uint64_t m_unreported = 0;
};

void walk_packets(const WalkJob& job)
{
    PacketWalk(job).run();
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace beamspread {

namespace {

void walk_scalar(const WalkJob& job)
{
    for (std::size_t b = 0; b < job.photons.size(); ++b) {
        Random random(job.seed, job.stream, job.first_batch + b);
        for (std::uint64_t done = 0; done < job.photons[b];) {
            const std::uint64_t block = std::min(photons_per_progress, job.photons[b] - done);
            for (std::uint64_t i = 0; i < block; ++i)
                walk_photon(job.medium, job.theta_inside, random, job.tallies[b]);
            done += block;
            job.progress.advance(static_cast<double>(block));
        }
    }
}

}  // namespace

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
