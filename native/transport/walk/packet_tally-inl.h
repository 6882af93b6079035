// Adds the exits of the vectorized walk to the tallies. Compiled once per target, like packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H
#undef BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PACKET_TALLY_INL_H
#endif

#include <array>
#include <vector>

#include "transport/tally/tally.h"
#include "transport/walk/packet_math-inl.h"
#include "transport/walk/walk.h"

HWY_BEFORE_NAMESPACE();
namespace beamspread {
namespace HWY_NAMESPACE {

// An exit's tag: order, side, batch and reflections (transport/tally/tally.h) in one word. n reflections are n bits set
// from `reflections_shift` on.
constexpr int side_shift = 20;
constexpr int batch_shift = 21;
constexpr int reflections_shift = 28;
constexpr std::uint32_t order_bits = max_order - 1;
constexpr std::uint32_t batch_bits = (1u << reflections_shift) - (1u << batch_shift);
static_assert(max_order <= 1u << side_shift);
static_assert(max_reflections <= 32 - reflections_shift);

// Bit of reflection i (from 0), and the bits of all reflections at the far boundary.
constexpr std::uint32_t reflection_bit(std::uint32_t i)
{
    return 1u << (static_cast<std::uint32_t>(reflections_shift) + i);
}
constexpr std::uint32_t far_reflection_bits = [] {
    std::uint32_t bits = 0;
    for (std::uint32_t i = 0; i < max_reflections; i += 2)
        bits |= reflection_bit(i);
    return bits;
}();

// Harmonics in a block, which are added together.
constexpr std::size_t block = 8;

// [m][k]: coefficient of c^k in the Chebyshev polynomial T_m(c), which is cos(m phi) for c = cos(phi).
constexpr auto chebyshev_coefficients = [] {
    std::array<std::array<double, block>, block> c{};
    c[0][0] = c[1][1] = 1.0;
    for (std::size_t m = 2; m < block; ++m)
        for (std::size_t k = 0; k <= m; ++k)
            c[m][k] = (k > 0 ? 2.0 * c[m - 1][k - 1] : 0.0) - c[m - 2][k];
    return c;
}();

// Collects exits and adds them to the tallies when they fill vectors. Until `finish`, the moment of harmonic 8 j + k
// holds T_8j(c) c^k, c = cos(phi): a step to the next block is one operation. Conversion to harmonics loses three
// digits within a block; powers of c alone would lose twelve at harmonic 63.
class PacketTally {
public:
    explicit PacketTally(const WalkJob& job) : m_job(job)
    {
        for (std::size_t batch = 0; batch < job.photons.size(); ++batch)
            m_tallies.push_back(&job.tallies[batch / job.batches_per_tally]);
    }

    HWY_INLINE void add(FloatMask mask, Floats x, Floats y, Floats weight, Words tag)
    {
        const Compression chosen(mask);
        chosen.store(floats, x, m_x.data() + m_count);
        chosen.store(floats, y, m_y.data() + m_count);
        chosen.store(floats, weight, m_weight.data() + m_count);
        chosen.store(words, tag, m_tag.data() + m_count);
        m_count += chosen.count();
        if (m_count > capacity)
            flush();
    }

    void finish()
    {
        flush();
        for (SideTallies& sides : m_job.tallies)
            for (Tally& tally : sides)
                to_harmonics(tally);
    }

private:
    static constexpr std::size_t capacity = 256;
    template <class T>
    using Queue = std::array<T, capacity + 2 * lane_count>;

    static void to_harmonics(Tally& tally)
    {
        for (std::size_t row = 0; row < row_count; ++row) {
            if (tally.weight[order_bin_of(row)] == 0.0)
                continue;
            for (std::size_t radius = 0; radius < radius_bin_count; ++radius)
                if (double* sums = tally.ring(row, radius); sums[0] != 0.0)
                    blocks_to_harmonics(sums, harmonics_of(row));
        }
    }

    // Converts sums of T_8j c^k to sums of T_8j+k = 2 T_8j T_k - T_8j-k (Abramowitz, Stegun 1964, Eq. 22.7.24).
    static void blocks_to_harmonics(double* sums, std::size_t count)
    {
        for (std::size_t first = 0; first < count; first += block) {
            std::array<double, block> powers;
            std::copy_n(sums + first, block, powers.begin());
            for (std::size_t m = 1; m < block; ++m) {
                double product = 0.0;  // T_8j T_m
                for (std::size_t k = m % 2; k <= m; k += 2)
                    product += chebyshev_coefficients[m][k] * powers[k];
                sums[first + m] = first == 0 ? product : 2.0 * product - sums[first - m];
            }
        }
    }

    HWY_NOINLINE void flush()
    {
        // Fill the last vector's unused lanes with finite values.
        for (std::size_t i = 0; i < lane_count; ++i) {
            m_x[m_count + i] = m_y[m_count + i] = 0.0f;
            m_tag[m_count + i] = 0;
        }
        for (std::size_t i = 0; i < m_count; i += lane_count)
            find_bins(i);
        for (std::size_t i = 0; i < m_count; ++i)
            add_exit(i);
        m_count = 0;
    }

    // Computes the bins of transport/tally/bins.h and cos(phi) of one vector of exits.
    HWY_INLINE void find_bins(std::size_t from)
    {
        constexpr int bias = 127;
        const hn::RebindToSigned<FloatTag> integers;
        const Words tag = hn::LoadU(words, m_tag.data() + from);
        const Tally& near = m_job.tallies[0][0];
        const Tally& far = m_job.tallies[0][1];
        const auto order = hn::BitCast(integers, hn::And(tag, hn::Set(words, order_bits)));
        const auto mirrored = hn::Lt(order, hn::Set(integers, static_cast<int>(near.mirrored_orders)));
        const FloatMask transmitted = float_mask(hn::TestBit(tag, hn::Set(words, 1u << side_shift)));
        Floats u = hn::IfThenElse(transmitted, broadcast(far.poles[0]), broadcast(near.poles[0]));
        auto rows_before = hn::Zero(integers);
        for (std::size_t pole = 1; pole < pole_count; ++pole) {
            // Pole p of the near side needs 2 p - 1 reflections, of the far side 2 p: see pole_of.
            const auto reflection = static_cast<std::uint32_t>(2 * (pole - 1));
            const Words bit =
                hn::IfThenElse(hn::RebindMask(words, transmitted), hn::Set(words, reflection_bit(reflection + 1)),
                               hn::Set(words, reflection_bit(reflection)));
            const auto here = hn::And(mirrored, hn::RebindMask(integers, hn::TestBit(tag, bit)));
            u = hn::IfThenElse(hn::RebindMask(floats, here),
                               hn::IfThenElse(transmitted, broadcast(far.poles[pole]), broadcast(near.poles[pole])), u);
            rows_before = hn::IfThenElse(here, hn::Set(integers, static_cast<int>(first_row(pole))), rows_before);
        }
        const Floats x = hn::Sub(hn::LoadU(floats, m_x.data() + from), u);
        const Floats y = hn::LoadU(floats, m_y.data() + from);
        const Floats r = hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)));
        const Floats cosine = hn::IfThenElse(hn::Gt(r, hn::Zero(floats)), hn::Div(x, r), broadcast(1.0));
        hn::StoreU(cosine, floats, m_x.data() + from);

        const auto quarter = hn::ShiftRight<within_bin_bits>(hn::BitCast(integers, r));
        const auto radius = hn::Sub(quarter, hn::Set(integers, 4 * (bias + min_radius_exponent) - 1));
        const auto radius_clamped =
            hn::Min(hn::Max(radius, hn::Zero(integers)), hn::Set(integers, static_cast<int>(radius_bin_count) - 1));
        const auto order_quarters =
            hn::ShiftRight<within_bin_bits>(hn::BitCast(integers, hn::ConvertTo(floats, order)));
        const auto binned = hn::Sub(order_quarters, hn::Set(integers, 4 * (bias + 4) - static_cast<int>(exact_orders)));
        const auto exact = hn::Lt(order, hn::Set(integers, static_cast<int>(exact_orders)));
        hn::StoreU(radius_clamped, integers, m_radius_bin.data() + from);
        const auto row = hn::Add(hn::IfThenElse(exact, order, binned), rows_before);
        hn::StoreU(row, integers, m_row.data() + from);
    }

    HWY_INLINE void add_exit(std::size_t i)
    {
        const std::uint32_t tag = m_tag[i];
        const std::size_t batch = (tag & batch_bits) >> batch_shift;
        const std::size_t side = (tag >> side_shift) & 1u;
        const auto row = static_cast<std::size_t>(m_row[i]);
        const std::size_t bin = order_bin_of(row);
        Tally& tally = (*m_tallies[batch])[side];
        add_blocks(tally.ring(row, static_cast<std::size_t>(m_radius_bin[i])), harmonics_of(row), m_x[i], m_weight[i]);
        const auto w = static_cast<double>(m_weight[i]);
        const double n = static_cast<double>(tag & order_bits);
        m_job.weights[batch][side][bin] += w;
        tally.weight[bin] += w;
        tally.weight_order[bin] += w * n;
        tally.weight_order2[bin] += w * n * n;
    }

    using DoubleTag = hn::CappedTag<double, 8>;
    using Doubles = hn::Vec<DoubleTag>;

    // Multiplies the lanes whose index has this bit by a factor.
    static HWY_INLINE Doubles times_where(std::uint64_t bit, Doubles values, double factor)
    {
        const DoubleTag doubles;
        const hn::RebindToUnsigned<DoubleTag> numbers;
        const auto lane = hn::BitCast(numbers, hn::Iota(hn::RebindToSigned<DoubleTag>(), 0));
        const auto chosen = hn::RebindMask(doubles, hn::TestBit(lane, hn::Set(numbers, bit)));
        return hn::IfThenElse(chosen, hn::Mul(values, hn::Set(doubles, factor)), values);
    }

    // sums[8 j + k] += weight * T_8j(c) c^k
    static HWY_INLINE void add_blocks(double* sums, std::size_t count, float cosine, float weight)
    {
        const DoubleTag doubles;
        constexpr std::size_t step = HWY_MIN(HWY_LANES(double), block);
        const double c = cosine;
        auto powers = hn::Set(doubles, static_cast<double>(weight));
        double power = c;  // c^bit
        for (std::uint64_t bit = 1; bit < step; bit *= 2) {
            powers = times_where(bit, powers, power);
            power *= power;
        }
        const double t2 = 2.0 * c * c - 1.0;
        const double t4 = 2.0 * t2 * t2 - 1.0;
        const auto t8 = hn::Set(doubles, 2.0 * t4 * t4 - 1.0);
        const auto twice_t8 = hn::Add(t8, t8);
        for (std::size_t part = 0; part < block; part += step) {
            auto previous = hn::Mul(t8, powers);  // T_-8 = T_8
            auto current = powers;
            for (double* to = sums + part; to < sums + count; to += block) {
                hn::StoreU(hn::Add(hn::LoadU(doubles, to), current), doubles, to);
                const auto next = hn::MulSub(twice_t8, current, previous);
                previous = current;
                current = next;
            }
            powers = hn::Mul(powers, hn::Set(doubles, power));
        }
    }

    const WalkJob& m_job;
    std::vector<SideTallies*> m_tallies;  // [batch]; saves a division per exit
    std::size_t m_count = 0;
    Queue<float> m_x{};  // replaced by cos(phi) in find_bins
    Queue<float> m_y{};
    Queue<float> m_weight{};
    Queue<std::uint32_t> m_tag{};
    Queue<std::int32_t> m_row{};
    Queue<std::int32_t> m_radius_bin{};
};

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
