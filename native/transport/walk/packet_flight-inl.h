// Flights of the vectorized walk, and what happens at their ends. Compiled once per target, like packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_FLIGHT_INL_H
#endif

#include "transport/walk/packet_math-inl.h"
#include "transport/walk/packet_optics-inl.h"
#include "transport/walk/packet_tally-inl.h"
#include "transport/walk/photon_pool-inl.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

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
