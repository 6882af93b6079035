// Photons of the vectorized walk, their scattering, and Fresnel's reflectance. Compiled once per target, like
// packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#endif

#include <array>

#include "medium/medium.h"
#include "transport/walk/packet_math-inl.h"
#include "transport/walk/packet_tally-inl.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

struct Deflection {
    Floats cos_theta;
    Floats sin_theta;
    Floats pdf;  // per steradian
};

// The Henyey-Greenstein phase function, see medium/medium.h.
class PhaseFunction {
public:
    explicit PhaseFunction(double g)
        : m_g(static_cast<float>(g)),
          m_forward(static_cast<float>(2.0 * (1.0 - g) * (1.0 - g))),
          m_sine(static_cast<float>(2.0 * (1.0 - g * g))),
          m_sample_pdf(static_cast<float>(0.25 * inv_pi / ((1.0 - g * g) * (1.0 - g * g)))),
          m_twice_g(static_cast<float>(2.0 * g)),
          m_one_plus_g2(static_cast<float>(1.0 + g * g)),
          m_pdf(static_cast<float>(0.25 * inv_pi * (1.0 - g * g)))
    {
    }

    // Inverts the distribution. With t = 1 + g (2 u - 1),
    //   1 - cos = 2 (1 - g)^2 (1 - u) (1 + g u) / t^2,   1 + cos = 2 (1 + g)^2 u (1 - g (1 - u)) / t^2,
    // which lose no digits for any g; the density is t^3 / (4 pi (1 - g^2)^2).
    HWY_INLINE Deflection sample(Floats u) const
    {
        const Floats one = broadcast(1.0);
        const Floats g = hn::Set(floats, m_g);
        const Floats rest = hn::Sub(one, u);
        const Floats t = hn::MulAdd(g, hn::Sub(u, rest), one);
        const Floats inv_t = hn::Div(one, t);
        const Floats inv_t2 = hn::Mul(inv_t, inv_t);
        const Floats forward = hn::Mul(rest, hn::MulAdd(g, u, one));
        const Floats backward = hn::Mul(u, hn::NegMulAdd(g, rest, one));
        const Floats cos_theta = hn::NegMulAdd(hn::Mul(hn::Set(floats, m_forward), forward), inv_t2, one);
        const Floats sin_theta =
            hn::Mul(hn::Mul(hn::Set(floats, m_sine), inv_t2), hn::Sqrt(hn::Mul(forward, backward)));
        const Floats pdf = hn::Mul(hn::Mul(hn::Set(floats, m_sample_pdf), t), hn::Mul(t, t));
        return {cos_theta, sin_theta, pdf};
    }

    // Density per steradian.
    HWY_INLINE Floats pdf(Floats cos_theta) const
    {
        const Floats denominator = hn::NegMulAdd(hn::Set(floats, m_twice_g), cos_theta, hn::Set(floats, m_one_plus_g2));
        return hn::Div(hn::Set(floats, m_pdf), hn::Mul(denominator, hn::Sqrt(denominator)));
    }

private:
    float m_g;
    float m_forward;
    float m_sine;
    float m_sample_pdf;
    float m_twice_g;
    float m_one_plus_g2;
    float m_pdf;
};

// Fresnel's reflectance from inside, see medium/medium.h.
class Boundary {
public:
    explicit Boundary(double ior)
        : m_matched(ior == 1.0), m_eta(static_cast<float>(1.0 / ior)), m_ior2(static_cast<float>(ior * ior))
    {
    }

    HWY_INLINE Floats reflectance(Floats cos_i) const
    {
        if (m_matched)
            return hn::Zero(floats);
        const Floats one = broadcast(1.0);
        const Floats eta = hn::Set(floats, m_eta);
        const Floats sin2_t = hn::Mul(hn::NegMulAdd(cos_i, cos_i, one), hn::Set(floats, m_ior2));
        const Floats cos_t = hn::Sqrt(hn::Max(hn::Zero(floats), hn::Sub(one, sin2_t)));
        const Floats eta_cos_i = hn::Mul(eta, cos_i);
        const Floats eta_cos_t = hn::Mul(eta, cos_t);
        const Floats parallel = hn::Div(hn::Sub(eta_cos_i, cos_t), hn::Add(eta_cos_i, cos_t));
        const Floats perpendicular = hn::Div(hn::Sub(cos_i, eta_cos_t), hn::Add(cos_i, eta_cos_t));
        const Floats mean =
            hn::Mul(broadcast(0.5), hn::MulAdd(parallel, parallel, hn::Mul(perpendicular, perpendicular)));
        return hn::IfThenElse(hn::Ge(sin2_t, one), one, mean);
    }

private:
    bool m_matched;
    float m_eta;
    float m_ior2;
};

// A medium's coefficients in single precision, converted once for all flights.
struct PacketMedium {
    explicit PacketMedium(const Medium& medium)
        : phase(medium.g), boundary(medium.ior), is_half_space(medium.is_half_space())
    {
    }

    PhaseFunction phase;
    Boundary boundary;
    bool is_half_space;
};

// One photon in each lane.
struct Photons {
    Vectors x;  // mean free paths; z points into the medium
    Vectors w;
    Floats weight;
    Words order;
    Words next_roulette;  // order
    Words batch;          // and reflections, as bits of an exit's tag: see transport/walk/packet_tally-inl.h
};

// Photons that wait for their next flights, stored without gaps.
class PhotonPool {
public:
    static constexpr std::size_t capacity = 512;  // photons; larger: fewer idle lanes, more cache

    std::size_t count() const { return m_count; }
    void clear() { m_count = 0; }

    HWY_INLINE Photons load(std::size_t first) const
    {
        const auto number = [&](std::size_t i) { return hn::LoadU(floats, m_numbers[i].data() + first); };
        const auto word = [&](std::size_t i) { return hn::LoadU(words, m_words[i].data() + first); };
        return {
            {number(0), number(1), number(2)}, {number(3), number(4), number(5)}, number(6), word(0), word(1), word(2)};
    }

    HWY_INLINE void append(FloatMask mask, const Photons& photons)
    {
        const Compression chosen(mask);
        std::size_t i = 0;
        for (const Floats values :
             {photons.x.x, photons.x.y, photons.x.z, photons.w.x, photons.w.y, photons.w.z, photons.weight})
            chosen.store(floats, values, m_numbers[i++].data() + m_count);
        i = 0;
        for (const Words values : {photons.order, photons.next_roulette, photons.batch})
            chosen.store(words, values, m_words[i++].data() + m_count);
        m_count += chosen.count();
    }

private:
    template <class T>
    using Queue = std::array<T, capacity + lane_count>;

    std::size_t m_count = 0;
    std::array<Queue<float>, 7> m_numbers{};
    std::array<Queue<std::uint32_t>, 3> m_words{};
};

// Moves and deflects the photons whose flights end inside the medium. Lanes that hit a boundary get garbage, which
// `reflect` of a shape replaces.
template <class Flight>
HWY_INLINE void scatter(Photons& photons, const Flight& flight, const Deflection& deflection, PacketRandom& random)
{
    const auto scatters = hn::RebindMask(words, hn::Not(flight.hits));
    photons.x = {hn::MulAdd(flight.length, photons.w.x, photons.x.x),
                 hn::MulAdd(flight.length, photons.w.y, photons.x.y),
                 hn::MulAdd(flight.length, photons.w.z, photons.x.z)};
    photons.w = deflect(photons.w, deflection.cos_theta, deflection.sin_theta, random_azimuth(random));
    photons.order = hn::Add(photons.order, hn::IfThenElseZero(scatters, hn::Set(words, 1u)));
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
