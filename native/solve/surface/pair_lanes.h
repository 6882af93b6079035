// Places of a surface's functions in the lanes of vectors, for sums over pairs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// Lanes of a block of functions: one vector.
inline constexpr std::size_t lanes_per_block = 16;

// Groups of lanes with tables of their own. Each result is a group, with the functions side by side; where functions are
// few, one group has those of all results, which takes fewer vectors. Moments are then repeated for each result.
class PairLanes {
public:
    PairLanes() = default;

    // `harmonics`: m of each function, the most important ones first.
    PairLanes(const ChannelSets& sets, const std::vector<std::int32_t>& harmonics);

    bool is_shared() const { return m_is_shared; }
    std::size_t group(std::size_t result) const { return m_is_shared ? 0 : result; }
    std::size_t lane(std::size_t result, std::size_t function) const
    {
        if (!m_is_shared)
            return function;
        const std::size_t of_block = lanes_per_block / results;  // functions
        return function / of_block * lanes_per_block + function % of_block * results + result;
    }

    // Adds the values of a block's lanes to the sums of their results.
    void add(std::size_t group, const float* values, float* sums) const
    {
        std::size_t result = m_is_shared ? 0 : group;
        for (std::size_t k = 0; k < lanes_per_block; ++k) {
            sums[result] += values[k];
            if (m_is_shared && ++result == results)
                result = 0;
        }
    }

    // Index of a function's moments among those of a sample, [set][block][cosine, sine][lane].
    std::size_t place(std::size_t result, std::size_t function) const
    {
        const std::size_t at = lane(result, function);
        return set[group(result)] * 2 * lanes() + at / lanes_per_block * 2 * lanes_per_block + at % lanes_per_block;
    }

    std::size_t lanes() const { return blocks * lanes_per_block; }  // of a group
    std::size_t moments() const { return m_sets * 2 * lanes(); }    // of a sample

    std::size_t results = 0;
    std::size_t groups = 0;
    std::size_t blocks = 0;              // of a group
    std::vector<std::int32_t> harmonic;  // [lane] m; 0 without a function
    std::size_t harmonic_bits = 0;       // bits of the largest m
    std::vector<float> is_first;         // [lane] 1 where m is 1, else 0
    std::vector<std::size_t> set;        // [group] of moments

private:
    bool m_is_shared = false;
    std::size_t m_sets = 0;  // of moments
};

}  // namespace beamspread
