// Photons of the vectorized walk, their flights, and what happens at the ends of these. Compiled once per target, like
// packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#endif

#include <array>

#include "transport/walk/packet_math-inl.h"
#include "transport/walk/packet_optics-inl.h"
#include "transport/walk/packet_tally-inl.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// One in each lane.
struct Photons {
    Vectors x;  // mean free paths; z points into the medium
    Vectors w;
    Floats weight;
    Words order;
    Words next_roulette;  // order
    Words batch;          // and reflections, shifted into place, see transport/walk/packet_tally-inl.h
};

// Photons that wait for their next flights, without gaps.
class PhotonPool {
public:
    static constexpr std::size_t capacity = 512;  // 256 and 1024 take as long, within 10 %

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

struct Flight {
    Floats length;    // free, to the next scattering
    Floats depth;     // of the boundary ahead, along the normal
    Floats cosine;    // between the flight and the normal
    FloatMask hits;   // the boundary, before it ends
};

HWY_INLINE Flight fly(const PacketMedium& medium, const Photons& photons, PacketRandom& random)
{
    const Floats length = minus_log(random.uniform());
    const Floats depth =
        hn::IfNegativeThenElse(photons.w.z, photons.x.z, hn::Sub(hn::Set(floats, medium.thickness), photons.x.z));
    // From below: a flight along the surface has a finite end that it never reaches.
    const Floats cosine = hn::Max(hn::Abs(photons.w.z), broadcast(1e-30));
    return {length, depth, cosine, hn::Ge(hn::Mul(length, cosine), depth)};
}

// The end of the flights that hit no boundary.
HWY_INLINE void scatter(Photons& photons, const Flight& flight, const Deflection& deflection, PacketRandom& random)
{
    const auto scatters = hn::RebindMask(words, hn::Not(flight.hits));
    photons.x = {hn::MulAdd(flight.length, photons.w.x, photons.x.x),
                 hn::MulAdd(flight.length, photons.w.y, photons.x.y),
                 hn::MulAdd(flight.length, photons.w.z, photons.x.z)};
    photons.w = deflect(photons.w, deflection.cos_theta, deflection.sin_theta, random_azimuth(random));
    photons.order = hn::Add(photons.order, hn::IfThenElseZero(scatters, hn::Set(words, 1u)));
}

// Inner reflection of some photons, given where they came from.
HWY_INLINE void reflect(Photons& photons, FloatMask mask, const Photons& from, Floats to_boundary, float thickness)
{
    const auto choose = [mask](Floats value, Floats& to) { to = hn::IfThenElse(mask, value, to); };
    const FloatMask up = hn::Lt(from.w.z, hn::Zero(floats));
    choose(hn::MulAdd(to_boundary, from.w.x, from.x.x), photons.x.x);
    choose(hn::MulAdd(to_boundary, from.w.y, from.x.y), photons.x.y);
    choose(hn::IfThenElse(up, hn::Zero(floats), hn::Set(floats, thickness)), photons.x.z);
    // See transport/tally/poles.h.
    const Words meets = hn::IfThenElse(hn::RebindMask(words, up), hn::Set(words, far_reflection_bits << 1),
                                       hn::Set(words, far_reflection_bits));
    const Words next = hn::Or(hn::Add(photons.batch, photons.batch), hn::Set(words, reflection_bit(0)));
    const Words reflected = hn::IfThenElseZero(hn::RebindMask(words, mask), hn::And(next, meets));
    photons.batch = hn::Or(photons.batch, reflected);
    choose(from.w.x, photons.w.x);
    choose(from.w.y, photons.w.y);
    choose(hn::Neg(from.w.z), photons.w.z);
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
