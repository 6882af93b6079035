#include "solve/spectral/channel_groups.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

// The factor between the light of two channels, if that is all they differ by; else 0.
double common_factor(const std::vector<Problem>& lights, std::size_t channel, std::size_t reference)
{
    double factor = 0.0;
    for (const Problem& light : lights) {
        const View2D<const float>& a = light.channels[channel].irradiance;
        const View2D<const float>& b = light.channels[reference].irradiance;
        if (a.data == b.data && (factor == 0.0 || factor == 1.0)) {
            factor = 1.0;
            continue;
        }
        for (std::size_t y = 0; y < a.height; ++y) {
            for (std::size_t x = 0; x < a.width; ++x) {
                const auto value = static_cast<double>(a(y, x));
                const auto other = static_cast<double>(b(y, x));
                if (factor == 0.0 && other > 0.0)
                    factor = value / other;
                // Products of single-precision numbers are off by less.
                if (std::abs(value - factor * other) > 3e-7 * value)
                    return 0.0;
            }
        }
    }
    return factor;
}

}  // namespace

std::vector<ChannelGroup> group_channels(const std::vector<Problem>& lights)
{
    std::vector<ChannelGroup> groups;
    for (std::size_t c = 0; c < lights.front().channels.size(); ++c) {
        const Channel& channel = lights.front().channels[c];
        double factor = 0.0;
        ChannelGroup* found = nullptr;
        for (ChannelGroup& group : groups) {
            factor = common_factor(lights, c, group.members.front().channel);
            found = factor > 0.0 ? &group : nullptr;
            if (found != nullptr)
                break;
        }
        if (found == nullptr) {
            factor = 1.0;
            found = &groups.emplace_back();
            for (const Problem& light : lights)
                found->lights.push_back({light.channels[c].irradiance, light.directions});
        }
        const KernelMedium medium{channel.library, channel.albedo, channel.mean_free_path};
        const auto known = std::find(found->media.begin(), found->media.end(), medium);
        found->members.push_back({c, static_cast<std::size_t>(known - found->media.begin()), factor});
        if (known == found->media.end())
            found->media.push_back(medium);
    }
    return groups;
}

}  // namespace beamspread
