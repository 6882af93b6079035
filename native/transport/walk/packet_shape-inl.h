// Boundaries of the medium for the vectorized walk, as transport/walk/walk_shape.h. Compiled once per target, like
// packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_SHAPE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_SHAPE_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_SHAPE_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_SHAPE_INL_H
#endif

#include <algorithm>

#include "medium/medium.h"
#include "transport/walk/packet_flight-inl.h"
#include "transport/walk/packet_math-inl.h"
#include "transport/walk/packet_tally-inl.h"
#include "transport/walk/walk.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// A sampled direction, and the boundary along it.
struct Connection {
    Vectors w;
    Floats distance;
    Floats cosine;
};

// Place at which light leaves; `side` is a bit of the exit's tag.
struct Exit {
    Floats u;
    Floats v;
    Words side;
};

HWY_INLINE void choose(FloatMask mask, Floats value, Floats& to)
{
    to = hn::IfThenElse(mask, value, to);
}

struct FlatFlight {
    Floats length;   // free, to the next scattering
    Floats depth;    // of the boundary ahead, along the normal
    Floats cosine;   // between the flight and the normal
    FloatMask hits;  // the boundary, before it ends

    HWY_INLINE Floats to_boundary() const { return hn::Div(depth, cosine); }

    // Far from the boundary the flight's length decides at random whether its exit is tallied: it comes this close with
    // probability exp(-to_boundary) / rare_exit.
    HWY_INLINE FloatMask comes_close() const
    {
        return hn::Ge(hn::Mul(hn::Add(length, broadcast(rare_exit_distance)), cosine), depth);
    }
};

class FlatPacketShape;

class FlatPacketCones {
public:
    FlatPacketCones(double exit_cone, bool is_half_space) : m_cone(exit_cone), m_is_half_space(is_half_space) {}

    // True in lanes whose direction may be a connection, too.
    HWY_INLINE FloatMask rivals(const Vectors& w) const
    {
        return m_is_half_space ? hn::Lt(w.z, hn::Zero(floats)) : hn::Eq(w.z, w.z);
    }

    // Density per steradian of sampled connections: proportional to the cosine, inside the cone that can leave.
    HWY_INLINE Floats pdf(const Vectors& w) const
    {
        const FloatMask inside = hn::Gt(hn::Mul(w.z, w.z), broadcast(1.0 - m_cone));
        return hn::IfThenElseZero(inside, hn::Mul(hn::Abs(w.z), broadcast(inv_pi / m_cone)));
    }

    HWY_INLINE Connection sample(const FlatPacketShape& /*shape*/, const Vectors& /*x*/, Floats depth, double side,
                                 PacketRandom& random) const
    {
        const Floats sin2 = hn::Mul(broadcast(m_cone), random.uniform());
        const Floats cos_theta = hn::Sqrt(hn::Sub(broadcast(1.0), sin2));
        const Floats sin_theta = hn::Sqrt(sin2);
        const SinCos azimuth = random_azimuth(random);
        const Vectors w{hn::Mul(sin_theta, azimuth.cosine), hn::Mul(sin_theta, azimuth.sine),
                        hn::Mul(broadcast(side), cos_theta)};
        return {w, hn::Div(depth, cos_theta), cos_theta};
    }

private:
    double m_cone;
    bool m_is_half_space;
};

class FlatPacketShape {
public:
    using Flight = FlatFlight;
    using Cones = FlatPacketCones;

    FlatPacketShape(const Medium& medium, double /*curvature*/, double exit_cone)
        : m_thickness(static_cast<float>(medium.thickness)), m_cones(exit_cone, medium.is_half_space())
    {
    }

    HWY_INLINE Flight fly(const Photons& photons, PacketRandom& random) const
    {
        const Floats length = minus_log(random.uniform());
        const Floats depth =
            hn::IfNegativeThenElse(photons.w.z, photons.x.z, hn::Sub(hn::Set(floats, m_thickness), photons.x.z));
        // The bound gives flights along the surface a finite end, which they never reach.
        const Floats cosine = hn::Max(hn::Abs(photons.w.z), broadcast(1e-30));
        return {length, depth, cosine, hn::Ge(hn::Mul(length, cosine), depth)};
    }

    // Reflects the chosen photons internally; `from` holds them before their flight.
    HWY_INLINE void reflect(Photons& photons, FloatMask mask, const Photons& from, Floats to_boundary) const
    {
        const FloatMask up = hn::Lt(from.w.z, hn::Zero(floats));
        choose(mask, hn::MulAdd(to_boundary, from.w.x, from.x.x), photons.x.x);
        choose(mask, hn::MulAdd(to_boundary, from.w.y, from.x.y), photons.x.y);
        choose(mask, hn::IfThenElse(up, hn::Zero(floats), hn::Set(floats, m_thickness)), photons.x.z);
        // Count the reflection as `reflections_after` does (transport/tally/tally.h).
        const Words meets = hn::IfThenElse(hn::RebindMask(words, up), hn::Set(words, far_reflection_bits << 1),
                                           hn::Set(words, far_reflection_bits));
        const Words next = hn::Or(hn::Add(photons.batch, photons.batch), hn::Set(words, reflection_bit(0)));
        const Words reflected = hn::IfThenElseZero(hn::RebindMask(words, mask), hn::And(next, meets));
        photons.batch = hn::Or(photons.batch, reflected);
        choose(mask, from.w.x, photons.w.x);
        choose(mask, from.w.y, photons.w.y);
        choose(mask, hn::Neg(from.w.z), photons.w.z);
    }

    HWY_INLINE Exit exit(const Vectors& x, const Vectors& w, Floats to_boundary) const
    {
        const FloatMask up = hn::Lt(w.z, hn::Zero(floats));
        return {hn::MulAdd(to_boundary, w.x, x.x), hn::MulAdd(to_boundary, w.y, x.y),
                hn::IfThenZeroElse(hn::RebindMask(words, up), hn::Set(words, 1u << side_shift))};
    }

    HWY_INLINE Floats depth(const Vectors& x, double side) const
    {
        return side < 0.0 ? x.z : hn::Sub(hn::Set(floats, m_thickness), x.z);
    }

    HWY_INLINE Cones cones(const Vectors& /*x*/) const { return m_cones; }

private:
    float m_thickness;
    Cones m_cones;
};

struct RoundFlight {
    Floats length;
    Floats distance;  // to the boundary
    Floats cosine;    // of incidence there
    FloatMask hits;

    HWY_INLINE Floats to_boundary() const { return distance; }

    HWY_INLINE FloatMask comes_close() const
    {
        return hn::Ge(hn::Add(length, broadcast(rare_exit_distance)), distance);
    }
};

class RoundPacketCone;

class RoundPacketShape {
public:
    using Flight = RoundFlight;
    using Cones = RoundPacketCone;

    RoundPacketShape(const Medium& /*medium*/, double curvature, double exit_cone)
        : m_curvature(static_cast<float>(curvature)),
          m_radius(static_cast<float>(1.0 / curvature)),
          m_exit_cone(exit_cone)
    {
    }

    HWY_INLINE Flight fly(const Photons& photons, PacketRandom& random) const
    {
        const Floats length = minus_log(random.uniform());
        Flight flight = {length, length, length, hn::Eq(length, length)};
        ahead(photons.x, photons.w, flight.distance, flight.cosine);
        flight.hits = hn::Ge(length, flight.distance);
        return flight;
    }

    HWY_INLINE void ahead(const Vectors& x, const Vectors& w, Floats& distance, Floats& cosine) const
    {
        const Floats k = hn::Set(floats, m_curvature);
        const Floats d = level(x);
        const Floats b = hn::NegMulAdd(k, dot(x, w), w.z);
        const Floats twice_d = hn::Add(d, d);
        const Floats cosine2 = hn::MulAdd(k, twice_d, hn::Mul(b, b));
        const Floats root = hn::Sqrt(hn::Max(cosine2, hn::Zero(floats)));
        const Floats near = hn::Div(twice_d, hn::Sub(root, b));
        if (m_curvature > 0.0f) {
            distance = hn::IfNegativeThenElse(b, near, hn::Mul(hn::Add(root, b), hn::Set(floats, m_radius)));
        } else {
            const FloatMask misses = hn::Or(hn::Ge(b, hn::Zero(floats)), hn::Lt(cosine2, hn::Zero(floats)));
            distance = hn::IfThenElse(misses, broadcast(never), near);
        }
        cosine = hn::Min(root, broadcast(1.0));
    }

    HWY_INLINE void reflect(Photons& photons, FloatMask mask, const Photons& from, Floats to_boundary) const
    {
        const Vectors x = along(from.x, from.w, to_boundary);
        const Vectors n = inward(x);
        const Floats twice = hn::Mul(broadcast(-2.0), dot(from.w, n));
        choose(mask, x.x, photons.x.x);
        choose(mask, x.y, photons.x.y);
        choose(mask, x.z, photons.x.z);
        choose(mask, hn::MulAdd(twice, n.x, from.w.x), photons.w.x);
        choose(mask, hn::MulAdd(twice, n.y, from.w.y), photons.w.y);
        choose(mask, hn::MulAdd(twice, n.z, from.w.z), photons.w.z);
    }

    HWY_INLINE Exit exit(const Vectors& x, const Vectors& w, Floats to_boundary) const
    {
        const Vectors y = along(x, w, to_boundary);
        const Floats along2 = hn::Max(hn::MulAdd(y.x, y.x, hn::Mul(y.y, y.y)), broadcast(1e-30));
        const Floats scale = hn::Sqrt(hn::Add(broadcast(1.0), hn::Div(hn::Mul(y.z, y.z), along2)));
        return {hn::Mul(y.x, scale), hn::Mul(y.y, scale), hn::Zero(words)};
    }

    HWY_INLINE Floats depth(const Vectors& x, double /*side*/) const
    {
        const Floats d = level(x);
        const Floats twice_d = hn::Add(d, d);
        const Floats ratio2 = hn::NegMulAdd(hn::Set(floats, m_curvature), twice_d, broadcast(1.0));
        return hn::Div(twice_d, hn::Add(broadcast(1.0), hn::Sqrt(hn::Max(ratio2, hn::Zero(floats)))));
    }

    HWY_INLINE Cones cones(const Vectors& x) const;

private:
    // Distance of a boundary that is not met, mean free paths: no flight is as long.
    static constexpr double never = 1e18;

    static HWY_INLINE Vectors along(const Vectors& x, const Vectors& w, Floats distance)
    {
        return {hn::MulAdd(distance, w.x, x.x), hn::MulAdd(distance, w.y, x.y), hn::MulAdd(distance, w.z, x.z)};
    }

    HWY_INLINE Floats level(const Vectors& x) const
    {
        const Floats half_k = hn::Set(floats, 0.5f * m_curvature);
        return hn::Max(hn::NegMulAdd(half_k, dot(x, x), x.z), hn::Zero(floats));
    }

    HWY_INLINE Vectors inward(const Vectors& x) const
    {
        const Floats k = hn::Set(floats, m_curvature);
        return {hn::Neg(hn::Mul(k, x.x)), hn::Neg(hn::Mul(k, x.y)), hn::NegMulAdd(k, x.z, broadcast(1.0))};
    }

    float m_curvature;
    float m_radius;
    double m_exit_cone;
};

class RoundPacketCone {
public:
    RoundPacketCone(const Vectors& axis, Floats cone) : m_axis(axis), m_cone(cone) {}

    HWY_INLINE FloatMask rivals(const Vectors& w) const { return hn::Gt(dot(w, m_axis), hn::Zero(floats)); }

    HWY_INLINE Floats pdf(const Vectors& w) const
    {
        const Floats cosine = dot(w, m_axis);
        const FloatMask inside =
            hn::And(hn::Gt(cosine, hn::Zero(floats)), hn::Gt(hn::Mul(cosine, cosine), hn::Sub(broadcast(1.0), m_cone)));
        return hn::IfThenElseZero(inside, hn::Div(hn::Mul(cosine, broadcast(inv_pi)), m_cone));
    }

    HWY_INLINE Connection sample(const RoundPacketShape& shape, const Vectors& x, Floats /*depth*/, double /*side*/,
                                 PacketRandom& random) const
    {
        const Floats sin2 = hn::Mul(m_cone, random.uniform());
        const Vectors w =
            deflect(m_axis, hn::Sqrt(hn::Sub(broadcast(1.0), sin2)), hn::Sqrt(sin2), random_azimuth(random));
        Connection to = {w, sin2, sin2};
        shape.ahead(x, w, to.distance, to.cosine);
        return to;
    }

private:
    Vectors m_axis;
    Floats m_cone;  // squared sine of the half angle
};

HWY_INLINE RoundPacketCone RoundPacketShape::cones(const Vectors& x) const
{
    const Vectors n = inward(x);
    const Floats ratio2 = hn::Max(dot(n, n), broadcast(1e-20));
    const Floats scale = hn::Div(broadcast(-1.0), hn::Sqrt(ratio2));
    return {{hn::Mul(n.x, scale), hn::Mul(n.y, scale), hn::Mul(n.z, scale)},
            hn::Min(hn::Div(broadcast(m_exit_cone), ratio2), broadcast(1.0))};
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
