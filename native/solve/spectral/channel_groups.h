// Channels that are solved together.
#pragma once

#include <cstddef>
#include <vector>

#include "solve/problem/light_field.h"
#include "solve/problem/problem.h"
#include "solve/separable/low_rank.h"

namespace beamspread {

// Channels whose light is the same but for a factor.
struct ChannelGroup {
    std::vector<LightField> lights;
    std::vector<KernelMedium> media;
    struct Member {
        std::size_t channel;
        std::size_t medium;
        double factor;
    };
    std::vector<Member> members;
};

std::vector<ChannelGroup> group_channels(const std::vector<Problem>& lights);

}  // namespace beamspread
