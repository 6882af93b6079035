// What scattering and the boundary do to many photons at a time. Compiled once per target, like packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_OPTICS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_OPTICS_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_OPTICS_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_OPTICS_INL_H
#endif

#include "medium/medium.h"
#include "transport/walk/packet_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

struct Deflection {
    Floats cos_theta;
    Floats sin_theta;
    Floats pdf;  // per steradian
};

// The Henyey-Greenstein phase function, see medium/henyey_greenstein.h.
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

    // With t = 1 + g (2 u - 1) its inverted distribution gives
    //   1 - cos = 2 (1 - g)^2 (1 - u) (1 + g u) / t^2,   1 + cos = 2 (1 + g)^2 u (1 - g (1 - u)) / t^2,
    // which lose no digits for any g, and the density is t^3 / (4 pi (1 - g^2)^2).
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

    // Per steradian.
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

// Fresnel's reflectance from inside, see medium/fresnel.h.
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

// A medium in single precision: what a flight needs of it is converted once, not at each.
struct PacketMedium {
    explicit PacketMedium(const Medium& medium)
        : phase(medium.g),
          boundary(medium.ior),
          thickness(static_cast<float>(medium.thickness)),
          is_half_space(medium.is_half_space())
    {
    }

    PhaseFunction phase;
    Boundary boundary;
    float thickness;
    bool is_half_space;
};

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
