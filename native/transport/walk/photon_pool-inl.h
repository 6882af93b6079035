// Photons of the vectorized walk. Compiled once per target, like packet_math-inl.h.
#if defined(BEAMSPREAD_TRANSPORT_PHOTON_POOL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BEAMSPREAD_TRANSPORT_PHOTON_POOL_INL_H
#undef BEAMSPREAD_TRANSPORT_PHOTON_POOL_INL_H
#else
#define BEAMSPREAD_TRANSPORT_PHOTON_POOL_INL_H
#endif

#include <array>

#include "transport/walk/packet_math-inl.h"

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

}  // namespace HWY_NAMESPACE
}  // namespace beamspread
HWY_AFTER_NAMESPACE();

#endif
