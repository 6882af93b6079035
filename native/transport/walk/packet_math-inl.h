// Random numbers and directions for one photon per vector lane. Compiled once per target, hence the toggled include
// guard (Highway's documentation, "foreach_target").
#if defined(BEAMSPREAD_TRANSPORT_PACKET_MATH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_MATH_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_MATH_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_MATH_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/constants.h"
#include "base/random.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using WordTag = hn::RebindToUnsigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Words = hn::Vec<WordTag>;
using FloatMask = hn::Mask<FloatTag>;

constexpr FloatTag floats;
constexpr WordTag words;
constexpr std::size_t lane_count = HWY_LANES(float);

HWY_INLINE Floats broadcast(double value)
{
    return hn::Set(floats, static_cast<float>(value));
}

HWY_INLINE FloatMask float_mask(hn::Mask<WordTag> mask)
{
    return hn::RebindMask(floats, mask);
}

// a > b for numbers below 2^31.
HWY_INLINE FloatMask greater(Words a, Words b)
{
    const hn::RebindToSigned<FloatTag> integers;
    return hn::RebindMask(floats, hn::Gt(hn::BitCast(integers, a), hn::BitCast(integers, b)));
}

// Order that moves the lanes of a mask to the front.
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
// AVX2 and SSE4 have no compress instruction. hn::Compress looks up the order for each vector anew, in a table of a
// kilobyte that GCC first copies onto the stack: two thirds of the walk's time with AVX2.
using LaneOrder = Words;

// [mask][lane]: lane that the value comes from.
constexpr auto lane_orders = [] {
    std::array<std::array<std::uint8_t, lane_count>, std::size_t{1} << lane_count> from{};
    for (std::size_t mask = 0; mask < from.size(); ++mask)
        for (std::size_t lane = 0, count = 0; lane < lane_count; ++lane)
            if ((mask >> lane & 1U) != 0)
                from[mask][count++] = static_cast<std::uint8_t>(lane);
    return from;
}();

HWY_INLINE LaneOrder lane_order(FloatMask mask)
{
    std::array<std::uint8_t, sizeof(std::uint64_t)> bits{};
    hn::StoreMaskBits(floats, mask, bits.data());
    return hn::PromoteTo(words, hn::LoadU(hn::Rebind<std::uint8_t, WordTag>(), lane_orders[bits[0]].data()));
}

template <class D>
HWY_INLINE hn::Vec<D> reordered(D tag, hn::Vec<D> values, LaneOrder order)
{
    return hn::TableLookupLanes(values, hn::IndicesFromVec(tag, order));
}
#else
using LaneOrder = FloatMask;

HWY_INLINE LaneOrder lane_order(FloatMask mask)
{
    return mask;
}

template <class D>
HWY_INLINE hn::Vec<D> reordered(D tag, hn::Vec<D> values, LaneOrder order)
{
    return hn::Compress(values, hn::RebindMask(tag, order));
}
#endif

// Moves the chosen lanes of any number of vectors to the front.
class Compression {
public:
    HWY_INLINE explicit Compression(FloatMask mask) : m_order(lane_order(mask)), m_count(hn::CountTrue(floats, mask)) {}

    // Number of chosen lanes.
    HWY_INLINE std::size_t count() const { return m_count; }

    // Stores a whole vector, which `to` must have room for: hn::CompressStore, which writes the chosen lanes alone,
    // takes hundreds of cycles on some processors (Zen 4).
    template <class D>
    HWY_INLINE void store(D tag, hn::Vec<D> values, hn::TFromD<D>* to) const
    {
        hn::StoreU(reordered(tag, values, m_order), tag, to);
    }

private:
    LaneOrder m_order;
    std::size_t m_count;
};

struct RandomState {
    HWY_ALIGN std::uint32_t word[4][lane_count];
};

// xoshiro128+ (Blackman, Vigna 2021, doi:10.1145/3460772), one generator per lane. Its lowest bits are weak and are not
// used.
class PacketRandom {
public:
    static void seed(Random& random, RandomState& state)
    {
        for (auto& lanes : state.word)
            for (std::uint32_t& lane : lanes)
                lane = static_cast<std::uint32_t>(random.bits() >> 32);
    }

    HWY_INLINE explicit PacketRandom(RandomState& state)
        : m_state(state),
          m_0(hn::Load(words, state.word[0])),
          m_1(hn::Load(words, state.word[1])),
          m_2(hn::Load(words, state.word[2])),
          m_3(hn::Load(words, state.word[3]))
    {
    }

    // Writes the state back, for the next object to continue.
    HWY_INLINE void store() const
    {
        hn::Store(m_0, words, m_state.word[0]);
        hn::Store(m_1, words, m_state.word[1]);
        hn::Store(m_2, words, m_state.word[2]);
        hn::Store(m_3, words, m_state.word[3]);
    }

    HWY_INLINE Words bits()
    {
        const Words result = hn::Add(m_0, m_3);
        const Words shifted = hn::ShiftLeft<9>(m_1);
        m_2 = hn::Xor(m_2, m_0);
        m_3 = hn::Xor(m_3, m_1);
        m_1 = hn::Xor(m_1, m_2);
        m_0 = hn::Xor(m_0, m_3);
        m_2 = hn::Xor(m_2, shifted);
        m_3 = hn::RotateRight<21>(m_3);
        return result;
    }

    // Uniform in (0, 1): the midpoints of 2^23 cells. They bound flights to 16.6 mean free paths, which shortens the
    // mean by 1e-6.
    HWY_INLINE Floats uniform()
    {
        // Floats in [1, 2) are equally spaced, hence the difference is exact.
        const Words one_to_two = hn::Or(hn::ShiftRight<9>(bits()), hn::Set(words, 0x3f800000u));
        return hn::Sub(hn::BitCast(floats, one_to_two), hn::Set(floats, 1.0f - 0x1p-24f));
    }

private:
    RandomState& m_state;
    Words m_0;
    Words m_1;
    Words m_2;
    Words m_3;
};

struct SinCos {
    Floats sine;
    Floats cosine;
};

// Sine and cosine of a uniform angle: Taylor series of an angle in [-pi/4, pi/4), with remainders below 2e-9 and 3e-8,
// then a rotation by a random multiple of pi/2.
HWY_INLINE SinCos random_azimuth(PacketRandom& random)
{
    const hn::RebindToSigned<FloatTag> integers;
    const Words bits = random.bits();
    const Floats cell = hn::ConvertTo(floats, hn::BitCast(integers, hn::ShiftRight<9>(bits)));
    const Floats x = hn::MulAdd(cell, broadcast(0.5 * pi * 0x1p-23), broadcast(0.5 * pi * (0x1p-24 - 0.5)));
    const Floats x2 = hn::Mul(x, x);
    Floats sine = broadcast(1.0 / 362880);
    sine = hn::MulAdd(sine, x2, broadcast(-1.0 / 5040));
    sine = hn::MulAdd(sine, x2, broadcast(1.0 / 120));
    sine = hn::MulAdd(sine, x2, broadcast(-1.0 / 6));
    sine = hn::MulAdd(hn::Mul(sine, x2), x, x);
    Floats cosine = broadcast(1.0 / 40320);
    cosine = hn::MulAdd(cosine, x2, broadcast(-1.0 / 720));
    cosine = hn::MulAdd(cosine, x2, broadcast(1.0 / 24));
    cosine = hn::MulAdd(cosine, x2, broadcast(-0.5));
    cosine = hn::MulAdd(cosine, x2, broadcast(1.0));

    // Rotate: bit 8 exchanges sine and cosine, bit 7 adds pi.
    const FloatMask exchanged = float_mask(hn::TestBit(bits, hn::Set(words, 1u << 8)));
    const Words sign_bit = hn::And(hn::ShiftLeft<24>(bits), hn::Set(words, 1u << 31));
    const Floats sign = hn::BitCast(floats, sign_bit);
    const Floats rotated_sine = hn::IfThenElse(exchanged, cosine, sine);
    const Floats rotated_cosine = hn::IfThenElse(exchanged, hn::Neg(sine), cosine);
    return {hn::Xor(rotated_sine, sign), hn::Xor(rotated_cosine, sign)};
}

struct Vectors {
    Floats x;
    Floats y;
    Floats z;
};

HWY_INLINE Floats dot(const Vectors& a, const Vectors& b)
{
    return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

// Deflects w by a polar angle and an azimuth (Duff et al. 2017, JCGT 6(1)).
HWY_INLINE Vectors deflect(const Vectors& w, Floats cos_theta, Floats sin_theta, const SinCos& azimuth)
{
    const Floats one = broadcast(1.0);
    const Floats sign_bit = hn::And(w.z, hn::SignBit(floats));
    const Floats sign = hn::Or(one, sign_bit);
    const Floats k = hn::Div(broadcast(-1.0), hn::Add(sign, w.z));
    const Floats xy = hn::Mul(hn::Mul(w.x, w.y), k);
    const Floats a = hn::Mul(sin_theta, azimuth.cosine);
    const Floats b = hn::Mul(sin_theta, azimuth.sine);
    const Floats signed_x = hn::Xor(w.x, sign_bit);
    const Floats tangent_x = hn::MulAdd(signed_x, hn::Mul(w.x, k), one);
    const Floats bitangent_y = hn::MulAdd(hn::Mul(w.y, w.y), k, sign);
    return {hn::MulAdd(tangent_x, a, hn::MulAdd(xy, b, hn::Mul(w.x, cos_theta))),
            hn::MulAdd(hn::Xor(xy, sign_bit), a, hn::MulAdd(bitangent_y, b, hn::Mul(w.y, cos_theta))),
            hn::NegMulAdd(signed_x, a, hn::NegMulAdd(w.y, b, hn::Mul(w.z, cos_theta)))};
}

// Restores the length 1 after rounding, by one step of Newton's method.
HWY_INLINE Vectors renormalized(const Vectors& w)
{
    const Floats scale = hn::NegMulAdd(broadcast(0.5), dot(w, w), broadcast(1.5));
    return {hn::Mul(w.x, scale), hn::Mul(w.y, scale), hn::Mul(w.z, scale)};
}

// -log of a normal number, by the method of FreeBSD's logf as in hn::Log, which also handles subnormal numbers.
HWY_INLINE Floats minus_log(Floats x)
{
    const hn::RebindToSigned<FloatTag> integers;
    constexpr std::int32_t bits_of_one = 0x3f800000;
    constexpr std::int32_t bits_of_sqrt_half = 0x3f3504f3;
    constexpr int mantissa_bits = 23;
    const auto bits = hn::Add(hn::BitCast(integers, x), hn::Set(integers, bits_of_one - bits_of_sqrt_half));
    const Floats exponent = hn::ConvertTo(floats, hn::Sub(hn::ShiftRight<mantissa_bits>(bits), hn::Set(integers, 127)));
    const Floats y = hn::BitCast(floats, hn::Add(hn::And(bits, hn::Set(integers, (1 << mantissa_bits) - 1)),
                                                 hn::Set(integers, bits_of_sqrt_half)));  // in [sqrt(1/2), sqrt(2))
    const Floats f = hn::Sub(y, broadcast(1.0));
    const Floats s = hn::Div(f, hn::Add(y, broadcast(1.0)));
    const Floats s2 = hn::Mul(s, s);
    const Floats s4 = hn::Mul(s2, s2);
    const Floats odd = hn::MulAdd(hn::Set(floats, 0.28498786688f), s4, hn::Set(floats, 0.66666662693f));
    const Floats even = hn::MulAdd(hn::Set(floats, 0.24279078841f), s4, hn::Set(floats, 0.40000972152f));
    const Floats series = hn::MulAdd(odd, s2, hn::Mul(even, s4));
    // log 2 in two parts; the first has few digits, so that its product with the exponent is exact.
    const Floats low = hn::Mul(exponent, hn::Set(floats, 9.0580006145e-6f));
    const Floats rest = hn::Sub(hn::MulSub(s, hn::Sub(f, series), low), f);
    return hn::NegMulAdd(exponent, hn::Set(floats, 0.69313812256f), rest);
}

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
