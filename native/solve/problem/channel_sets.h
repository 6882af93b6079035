// Channels that share their light, and channels that share their result.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/problem/problem.h"

namespace beamspread {

// Sets of channels with proportional light: each channel's light is a factor times that of its set. Lights of one
// colour make one set, lights of different colours at most one per channel. Channels of one set and medium share a
// result.
struct ChannelSets {
    struct Member {
        std::size_t channel;
        double factor;
    };
    struct Result {
        std::size_t set;
        std::size_t medium;
        std::vector<Member> members;
    };

    explicit ChannelSets(const Problem& problem);

    std::size_t count() const { return m_reference.size(); }

    // The reference channel of a set, and a light's colour in it.
    std::size_t channel(std::size_t set) const { return m_reference[set]; }
    double color(const PlaneLight& light, std::size_t set) const { return light.color[m_reference[set]]; }

    std::vector<ChannelMedium> media;
    std::vector<Result> results;

private:
    std::vector<std::size_t> m_reference;  // [set]
};

}  // namespace beamspread
