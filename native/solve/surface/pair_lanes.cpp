#include "solve/surface/pair_lanes.h"

#include <algorithm>
#include <bit>

namespace beamspread {

namespace {

// Blocks that all results share at most. More: more memory for moments, fewer vectors.
constexpr std::size_t max_shared_blocks = 2;

std::size_t blocks_of(std::size_t functions)
{
    return (functions + lanes_per_block - 1) / lanes_per_block;
}

}  // namespace

PairLanes::PairLanes(const ChannelSets& sets, const std::vector<std::int32_t>& harmonics)
    : results(sets.results.size()), groups(results), blocks(blocks_of(harmonics.size())), m_sets(sets.count())
{
    const std::size_t of_block = lanes_per_block / std::max<std::size_t>(results, 1);
    const std::size_t shared = (harmonics.size() + of_block - 1) / of_block;
    if (shared < results * blocks && shared <= max_shared_blocks) {
        m_is_shared = true;
        groups = 1;
        blocks = shared;
        m_sets = 1;
    }
    for (std::size_t group = 0; group < groups; ++group)
        set.push_back(m_is_shared ? 0 : sets.results[group].set);
    harmonic.resize(lanes());
    for (const std::int32_t m : harmonics)
        harmonic_bits = std::max<std::size_t>(harmonic_bits, std::bit_width(static_cast<std::uint32_t>(m)));
    for (std::size_t result = 0; result < results; ++result)
        for (std::size_t function = 0; function < harmonics.size(); ++function)
            harmonic[lane(result, function)] = harmonics[function];
    for (const std::int32_t m : harmonic)
        is_first.push_back(m == 1 ? 1.0f : 0.0f);
}

}  // namespace beamspread
