// Exits of many photons at a time on their way into the tallies. Compiled once per target, like packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H
#endif

#include <array>
#include <span>

#include "transport/packet_math-inl.h"
#include "transport/tally.h"
#include "transport/walk.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// Order, side and batch of an exit in one word.
constexpr int side_shift = 20;
constexpr int batch_shift = 21;
static_assert(max_order <= 1u << side_shift);

// [m][k]: of cos(phi)^k in cos(m phi).
constexpr auto chebyshev_coefficients = [] {
    std::array<std::array<double, harmonic_count>, harmonic_count> c{};
    c[0][0] = c[1][1] = 1.0;
    for (std::size_t m = 2; m < harmonic_count; ++m)
        for (std::size_t k = 0; k <= m; ++k)
            c[m][k] = (k > 0 ? 2.0 * c[m - 1][k - 1] : 0.0) - c[m - 2][k];
    return c;
}();

// Collects exits, and adds them to the tallies when there are enough to fill vectors. Until `finish` the moments
// hold powers of cos(phi) in the place of cos(m phi), which take no recurrence.
class PacketTally {
public:
    explicit PacketTally(std::span<SideTallies> batches) : m_batches(batches) {}

    HWY_INLINE void add(FloatMask mask, Floats x, Floats y, Floats weight, Words what)
    {
        hn::CompressStore(x, mask, floats, m_x.data() + m_count);
        hn::CompressStore(y, mask, floats, m_y.data() + m_count);
        hn::CompressStore(weight, mask, floats, m_weight.data() + m_count);
        m_count += hn::CompressStore(what, hn::RebindMask(words, mask), words, m_what.data() + m_count);
        if (m_count > capacity)
            flush();
    }

    void finish()
    {
        flush();
        for (SideTallies& sides : m_batches)
            for (Tally& tally : sides)
                for (std::size_t i = 0; i < tally.moments.size(); i += harmonic_count)
                    if (tally.moments[i] != 0.0)
                        powers_to_harmonics(tally.moments.data() + i);
    }

private:
    static constexpr std::size_t capacity = 256;
    template <class T>
    using Queue = std::array<T, capacity + 2 * lane_count>;

    // From sums of c^m, c = cos(phi), to sums of cos(m phi), which is the m-th Chebyshev polynomial of c.
    static void powers_to_harmonics(double* sums)
    {
        std::array<double, harmonic_count> powers;
        std::copy_n(sums, harmonic_count, powers.begin());
        for (std::size_t m = 0; m < harmonic_count; ++m) {
            sums[m] = 0.0;
            for (std::size_t k = m % 2; k <= m; k += 2)
                sums[m] += chebyshev_coefficients[m][k] * powers[k];
        }
    }

    HWY_NOINLINE void flush()
    {
        // What lies behind the last exit only has to be finite.
        for (std::size_t i = 0; i < lane_count; ++i) {
            m_x[m_count + i] = m_y[m_count + i] = 0.0f;
            m_what[m_count + i] = 0;
        }
        for (std::size_t i = 0; i < m_count; i += lane_count)
            find_bins(i);
        for (std::size_t i = 0; i < m_count; ++i)
            add_one(i);
        m_count = 0;
    }

    // The bins of transport/bins.h, read off the bits of a float.
    HWY_INLINE void find_bins(std::size_t first)
    {
        constexpr int quarter_bits = 21;
        constexpr int bias = 127;
        const hn::RebindToSigned<FloatTag> integers;
        const Words what = hn::LoadU(words, m_what.data() + first);
        const FloatMask transmitted = float_mask(hn::TestBit(what, hn::Set(words, 1u << side_shift)));
        const Floats centre =
            hn::IfThenElse(transmitted, broadcast(m_batches[0][1].centre), broadcast(m_batches[0][0].centre));
        const Floats x = hn::Sub(hn::LoadU(floats, m_x.data() + first), centre);
        const Floats y = hn::LoadU(floats, m_y.data() + first);
        const Floats r = hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)));
        const Floats cosine = hn::IfThenElse(hn::Gt(r, hn::Zero(floats)), hn::Div(x, r), broadcast(1.0));
        hn::StoreU(cosine, floats, m_x.data() + first);

        const auto quarters = hn::ShiftRight<quarter_bits>(hn::BitCast(integers, r));
        const auto radius = hn::Sub(quarters, hn::Set(integers, 4 * (bias + min_radius_exponent) - 1));
        const auto radius_clamped = hn::Min(hn::Max(radius, hn::Zero(integers)),
                                            hn::Set(integers, static_cast<std::int32_t>(radius_bin_count) - 1));
        const auto order = hn::BitCast(integers, hn::And(what, hn::Set(words, max_order - 1)));
        const auto order_quarters = hn::ShiftRight<quarter_bits>(hn::BitCast(integers, hn::ConvertTo(floats, order)));
        const auto binned = hn::Sub(order_quarters, hn::Set(integers, 4 * (bias + 4) - static_cast<int>(exact_orders)));
        const auto exact = hn::Lt(order, hn::Set(integers, static_cast<int>(exact_orders)));
        hn::StoreU(radius_clamped, integers, m_radius_bin.data() + first);
        hn::StoreU(hn::IfThenElse(exact, order, binned), integers, m_order_bin.data() + first);
    }

    HWY_INLINE void add_one(std::size_t i)
    {
        const std::uint32_t what = m_what[i];
        Tally& tally = m_batches[what >> batch_shift][(what >> side_shift) & 1u];
        const auto bin = static_cast<std::size_t>(m_order_bin[i]);
        const std::size_t place = bin * radius_bin_count + static_cast<std::size_t>(m_radius_bin[i]);
        add_powers(tally.moments.data() + place * harmonic_count, m_x[i], m_weight[i]);
        const auto w = static_cast<double>(m_weight[i]);
        const double n = static_cast<double>(what & (max_order - 1));
        tally.weight[bin] += w;
        tally.weight_order[bin] += w * n;
        tally.weight_order2[bin] += w * n * n;
    }

    using DoubleTag = hn::CappedTag<double, 8>;
    using Doubles = hn::Vec<DoubleTag>;

    // The values of the lanes whose number has this bit, times a factor; the others as they are.
    static HWY_INLINE Doubles times_where(std::uint64_t bit, Doubles values, double factor)
    {
        const DoubleTag doubles;
        const hn::RebindToUnsigned<DoubleTag> numbers;
        const auto lane = hn::BitCast(numbers, hn::Iota(hn::RebindToSigned<DoubleTag>(), 0));
        const auto chosen = hn::RebindMask(doubles, hn::TestBit(lane, hn::Set(numbers, bit)));
        return hn::IfThenElse(chosen, hn::Mul(values, hn::Set(doubles, factor)), values);
    }

    // sums[m] += weight * c^m
    static HWY_INLINE void add_powers(double* sums, float c, float weight)
    {
        const DoubleTag doubles;
        constexpr std::size_t step = HWY_MIN(HWY_LANES(double), 8);
        constexpr std::size_t last = harmonic_count - 1;
        static_assert(last % step == 0);
        auto powers = hn::Set(doubles, static_cast<double>(weight));
        double power = c;  // c^bit
        for (std::uint64_t bit = 1; bit < step; bit *= 2) {
            powers = times_where(bit, powers, power);
            power *= power;
        }
        for (std::size_t m = 0; m < last; m += step) {
            hn::StoreU(hn::Add(hn::LoadU(doubles, sums + m), powers), doubles, sums + m);
            powers = hn::Mul(powers, hn::Set(doubles, power));
        }
        sums[last] += hn::GetLane(powers);
    }

    std::span<SideTallies> m_batches;
    std::size_t m_count = 0;
    Queue<float> m_x{};  // then cos(phi)
    Queue<float> m_y{};
    Queue<float> m_weight{};
    Queue<std::uint32_t> m_what{};
    Queue<std::int32_t> m_order_bin{};
    Queue<std::int32_t> m_radius_bin{};
};

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
