#include "solve/problem/channel_sets.h"

#include <algorithm>
#include <cmath>

namespace beamspread {

namespace {

// Largest relative difference of proportional colours. Quotients of single-precision colours are off by up to 1.2e-7.
constexpr double same_color = 1e-6;

// The factor between the light of two channels; 0 if they are not proportional.
double common_factor(const std::vector<std::vector<double>>& colors, std::size_t channel, std::size_t reference)
{
    double factor = 0.0;
    for (const std::vector<double>& color : colors)
        if (color[reference] > 0.0)
            factor = std::max(factor, color[channel] / color[reference]);
    for (const std::vector<double>& color : colors)
        if (std::abs(color[channel] - factor * color[reference]) > same_color * color[channel])
            return 0.0;
    return factor;
}

}  // namespace

ChannelSets::ChannelSets(const Problem& problem)
{
    std::vector<std::vector<double>> colors;
    for (const auto* lights : {&problem.lights, &problem.coming.survey, &problem.coming.examples})
        for (const PlaneLight& light : *lights)
            colors.push_back(light.color);
    for (std::size_t c = 0; c < problem.channels.size(); ++c) {
        double factor = 0.0;
        std::size_t set = 0;
        while (set < m_reference.size()) {
            factor = common_factor(colors, c, m_reference[set]);
            if (factor != 0.0)
                break;
            ++set;
        }
        if (set == m_reference.size()) {
            m_reference.push_back(c);
            factor = 1.0;
        }
        const auto known = std::find(media.begin(), media.end(), problem.channels[c]);
        const auto medium = static_cast<std::size_t>(known - media.begin());
        if (known == media.end())
            media.push_back(problem.channels[c]);
        const auto shared = std::find_if(results.begin(), results.end(), [&](const Result& result) {
            return result.set == set && result.medium == medium;
        });
        if (shared == results.end())
            results.push_back({set, medium, {{c, factor}}});
        else
            shared->members.push_back({c, factor});
    }
}

}  // namespace beamspread
