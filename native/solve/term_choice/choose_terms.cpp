#include "solve/term_choice/choose_terms.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include <Eigen/Dense>

#include "base/threads.h"
#include "solve/term_choice/luminance_probe.h"
#include "solve/term_choice/probe_texels.h"

namespace beamspread {

namespace {

// On planes of up to so many texels, the square of this, all terms are kept: choosing would take as long.
constexpr std::size_t small_plane = 192;

// What the texels looked at may use up of the tolerance. The rest is for those between, and for what the probe is off
// by.
constexpr double share = 0.3;

// Of what is allowed: errors that need no weighing.
constexpr float negligible = 0.05f;

// So often there is a closer look around the texels where errors are largest; one that changes neither the choice nor,
// by more than this, the largest error is the last.
constexpr std::size_t refinements = 2;
constexpr float least_growth = 1.05f;
constexpr std::size_t worst_count = 64;

// Errors relative to the brightest texel that transforms in single precision make anyway.
constexpr double rounding = 5e-6;

Eigen::Index index(std::size_t i)
{
    return static_cast<Eigen::Index>(i);
}

// What each candidate brings to the luminance of the texels looked at, [texel and medium][candidate], in units of the
// error allowed there.
Eigen::ArrayXXf relative_parts(const std::vector<LuminanceProbe::Reading>& readings, std::size_t candidates,
                               double tolerance)
{
    const std::size_t media = readings.front().nearby.size();
    Eigen::ArrayXXf parts = Eigen::ArrayXXf::Zero(index(readings.size() * media), index(candidates));
    for (std::size_t k = 0; k < media; ++k) {
        double brightest = 0.0;
        for (const LuminanceProbe::Reading& reading : readings)
            brightest = std::max(brightest, reading.nearby[k]);
        for (std::size_t i = 0; i < readings.size(); ++i) {
            const double allowed = share * tolerance * readings[i].nearby[k] + rounding * brightest;
            for (std::size_t c = 0; c < candidates && allowed > 0.0; ++c)
                parts(index(i * media + k), index(c)) =
                    static_cast<float>(static_cast<double>(readings[i].parts[k * candidates + c]) / allowed);
        }
    }
    return parts;
}

struct Choice {
    std::vector<std::size_t> kept;
    Eigen::ArrayXf error;  // [texel and medium]
};

// Leaves out the least, as many as bring no more than `negligible` together anywhere: looking for the best order among
// them takes longest and changes nothing.
void leave_out_least(const Eigen::ArrayXXf& parts, Choice& choice)
{
    std::vector<std::size_t> order = choice.kept;
    std::vector<float> most(order.size());
    parallel_for(most.size(), [&](std::size_t c) { most[c] = parts.col(index(c)).abs().maxCoeff(); });
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return most[a] < most[b]; });
    float sum = 0.0f;
    std::size_t dropped = 0;
    for (; dropped < order.size() && sum + most[order[dropped]] <= negligible; ++dropped) {
        sum += most[order[dropped]];
        choice.error += parts.col(index(order[dropped]));
    }
    choice.kept.assign(order.begin() + static_cast<std::ptrdiff_t>(dropped), order.end());
    std::sort(choice.kept.begin(), choice.kept.end());
}

// Leaves out one after the other, always the one by which the sum of the errors' fourth powers grows least for what it
// costs, until each would take an error beyond 1.
Choice leave_out(const Eigen::ArrayXXf& parts, const std::vector<float>& cost)
{
    Choice choice{std::vector<std::size_t>(cost.size()), Eigen::ArrayXf::Zero(parts.rows())};
    auto& [kept, error] = choice;
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    leave_out_least(parts, choice);
    // The texel that each brings most to: it alone rules out most of those that are needed.
    std::vector<Eigen::Index> most(cost.size());
    parallel_for(most.size(), [&](std::size_t c) { parts.col(index(c)).abs().maxCoeff(&most[c]); });
    std::vector<float> growth;
    while (!kept.empty()) {
        const float now = error.square().square().sum();
        growth.assign(kept.size(), std::numeric_limits<float>::infinity());
        parallel_for(growth.size(), [&](std::size_t i) {
            const std::size_t c = choice.kept[i];
            if (std::abs(choice.error(most[c]) + parts(most[c], index(c))) > 1.0f)
                return;
            const Eigen::ArrayXf next = choice.error + parts.col(index(c));
            if (next.abs().maxCoeff() <= 1.0f)
                growth[i] = (next.square().square().sum() - now) / cost[c];
        });
        const auto least = std::min_element(growth.begin(), growth.end());
        if (*least == std::numeric_limits<float>::infinity())
            break;
        const auto dropped = kept.begin() + (least - growth.begin());
        error += parts.col(index(*dropped));
        kept.erase(dropped);
    }
    return choice;
}

// The texels with the largest errors.
std::vector<Texel> worst_texels(const std::vector<Texel>& texels, const Eigen::ArrayXf& error)
{
    const auto media = error.size() / index(texels.size());
    std::vector<float> worst;
    for (std::size_t i = 0; i < texels.size(); ++i)
        worst.push_back(error.segment(index(i) * media, media).abs().maxCoeff());
    std::vector<std::size_t> order(texels.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return worst[a] > worst[b]; });
    std::vector<Texel> found;
    for (std::size_t i = 0; i < std::min(worst_count, order.size()); ++i)
        found.push_back(texels[order[i]]);
    return found;
}

}  // namespace

std::vector<std::size_t> choose_terms(const KernelDecomposition& kernels, const std::vector<LightPyramid>& lights,
                                      double pitch_x, double pitch_y, double tolerance)
{
    std::vector<std::size_t> candidates(kernels.terms().size());
    std::iota(candidates.begin(), candidates.end(), std::size_t{0});
    const std::size_t height = lights.front().height();
    const std::size_t width = lights.front().width();
    if (candidates.empty() || height * width <= small_plane * small_plane)
        return candidates;

    std::vector<float> transforms;
    for (const KernelDecomposition::Term& term : kernels.terms())
        transforms.push_back(term.m > 0 ? 2.0f : 1.0f);
    const LuminanceProbe probe(lights, kernels.basis(candidates, rounding), pitch_x, pitch_y);
    std::vector<Texel> texels = probe_texels(lights, pitch_x, pitch_y);
    std::vector<LuminanceProbe::Reading> readings;
    std::vector<std::size_t> kept;
    float largest = 0.0f;
    for (std::size_t round = 0;; ++round) {
        const std::size_t known = readings.size();
        readings.resize(texels.size());
        parallel_for(texels.size() - known, [&](std::size_t i) {
            const auto& [y, x] = texels[known + i];
            readings[known + i] = probe.read(y, x);
        });
        Choice choice = leave_out(relative_parts(readings, candidates.size(), tolerance), transforms);
        const float error = choice.error.abs().maxCoeff();
        if (round == refinements || (round > 0 && choice.kept == kept && error <= least_growth * largest))
            return std::move(choice.kept);
        kept = std::move(choice.kept);
        largest = error;
        const std::vector<Texel> more = texels_around(worst_texels(texels, choice.error), height, width, round);
        texels.insert(texels.end(), more.begin(), more.end());
    }
}

}  // namespace beamspread
