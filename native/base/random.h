// Random numbers that depend on (seed, work item) alone, never on the thread that draws them.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace beamspread {

// SplitMix64 (Steele, Lea, Flood 2014, doi:10.1145/2660193.2660195): spreads consecutive keys over all 64 bits.
inline std::uint64_t split_mix(std::uint64_t& state)
{
    std::uint64_t z = (state += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}

// xoshiro256+ (Blackman, Vigna 2021, doi:10.1145/3460772). Only the upper bits, which pass all tests, are used.
class Random {
public:
    Random(std::uint64_t seed, std::uint64_t stream, std::uint64_t item)
    {
        std::uint64_t key = seed;
        key = split_mix(key) ^ stream;
        key = split_mix(key) ^ item;
        for (std::uint64_t& word : m_state)
            word = split_mix(key);
    }

    std::uint64_t bits()
    {
        const std::uint64_t result = m_state[0] + m_state[3];
        const std::uint64_t t = m_state[1] << 17;
        m_state[2] ^= m_state[0];
        m_state[3] ^= m_state[1];
        m_state[1] ^= m_state[2];
        m_state[0] ^= m_state[3];
        m_state[2] ^= t;
        m_state[3] = std::rotl(m_state[3], 45);
        return result;
    }

    // Uniform in [0, 1), multiples of 2^-53.
    double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

    // Uniform in (0, 1]: safe as the argument of a logarithm.
    double uniform_positive() { return static_cast<double>((bits() >> 11) + 1) * 0x1.0p-53; }

private:
    std::array<std::uint64_t, 4> m_state{};
};

}  // namespace beamspread
