#include "solve/term_choice/choose_terms.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <span>
#include <utility>

#include <Eigen/Dense>

#include "base/threads.h"
#include "solve/term_choice/probe_sites.h"
#include "solve/term_choice/radiance_probe.h"

namespace beamspread {

namespace {

// On planes of up to so many texels, the square of this, all terms are kept: choosing would take as long.
constexpr std::size_t small_plane = 192;

// What the texels looked at may use up of the tolerance. The rest is for those between, and for what the probe is off by:
// over the lights of tests/bench/terms.py the worst of all texels then uses up .57.
constexpr double share = 0.25;

// So often there is a closer look around the texels where errors are largest. Without, the worst texel there is off by
// twice as much, for 3 % fewer terms. Half as many texels are as good, twice as many take 1.2 times as long.
constexpr std::size_t refinements = 2;
constexpr std::size_t worst_count = 12;

// Errors relative to the brightest texel that transforms in single precision make anyway: half of the 1e-5 that tests
// leave to deep shadow.
constexpr double rounding = 5e-6;

// The mean of a site relative to what harmonic 0 alone would bring: where light travels away from, sums of harmonics are
// small, and off by about this. Half and twice choose the same.
constexpr double least_asymmetry = 0.01;

// Of many lights so many stand for all: the brightest, whose light changes most from texel to texel. Of 60 lamps of random
// colours 2 and 8 choose the same terms, in the same time.
constexpr std::size_t most_lights = 4;

using Readings = std::vector<std::vector<float>>;  // [texel][result and function]

Eigen::Index index(std::size_t i)
{
    return static_cast<Eigen::Index>(i);
}

std::vector<std::size_t> representatives(const Incidence& incidence)
{
    std::vector<std::size_t> lights(incidence.extremes.size());
    std::iota(lights.begin(), lights.end(), std::size_t{0});
    std::ranges::stable_sort(lights, std::greater{}, [&](std::size_t l) { return incidence.extremes[l].irradiance; });
    lights.resize(std::min(lights.size(), most_lights));
    return lights;
}

// What each candidate brings to the radiance of the texels looked at, [texel and result][candidate], in units of the
// error allowed there.
Eigen::ArrayXXf relative_parts(const Readings& readings, const std::vector<KernelDecomposition::Term>& terms,
                               double tolerance)
{
    const std::size_t candidates = terms.size();
    const std::size_t results = readings.front().size() / candidates;
    const std::size_t sites = readings.size() / texels_per_site;
    Eigen::ArrayXXf parts = Eigen::ArrayXXf::Zero(index(readings.size() * results), index(candidates));
    for (std::size_t r = 0; r < results; ++r) {
        std::vector<double> nearby(sites);
        for (std::size_t s = 0; s < sites; ++s) {
            double all = 0.0;
            double evenly = 0.0;  // by m = 0
            for (std::size_t i = s * texels_per_site; i < (s + 1) * texels_per_site; ++i)
                for (std::size_t c = 0; c < candidates; ++c) {
                    const auto part = static_cast<double>(readings[i][r * candidates + c]);
                    all += part;
                    evenly += terms[c].m == 0 ? part : 0.0;
                }
            nearby[s] = std::max(all, least_asymmetry * evenly) / static_cast<double>(texels_per_site);
        }
        const double brightest = *std::max_element(nearby.begin(), nearby.end());
        for (std::size_t i = 0; i < readings.size(); ++i) {
            const double allowed = share * tolerance * nearby[i / texels_per_site] + rounding * brightest;
            for (std::size_t c = 0; c < candidates && allowed > 0.0; ++c)
                parts(index(i * results + r), index(c)) =
                    static_cast<float>(static_cast<double>(readings[i][r * candidates + c]) / allowed);
        }
    }
    return parts;
}

// Leaves out one after the other, those first that bring least per transform, as long as no error is beyond 1.
// Finds those that are kept, and the errors of [texel and result].
std::pair<std::vector<std::size_t>, Eigen::ArrayXf> leave_out(const Eigen::ArrayXXf& parts,
                                                              const std::vector<KernelDecomposition::Term>& terms)
{
    // Fourth powers, as the few texels where a term brings most decide whether it is needed.
    std::vector<float> worth(terms.size());
    parallel_for(worth.size(), [&](std::size_t c) {
        worth[c] = parts.col(index(c)).square().square().sum() / (terms[c].m > 0 ? 2.0f : 1.0f);
    });
    std::vector<std::size_t> order(terms.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t c) { return worth[c]; });
    std::vector<std::size_t> kept;
    Eigen::ArrayXf error = Eigen::ArrayXf::Zero(parts.rows());
    for (const std::size_t c : order) {
        Eigen::ArrayXf next = error + parts.col(index(c));
        if (next.abs().maxCoeff() <= 1.0f)
            error.swap(next);
        else
            kept.push_back(c);
    }
    std::ranges::sort(kept);
    return {std::move(kept), std::move(error)};
}

// The middles of the sites with the largest errors.
std::vector<Texel> worst_sites(const std::vector<Texel>& texels, const Eigen::ArrayXf& error)
{
    const Eigen::Index sites = index(texels.size() / texels_per_site);
    const Eigen::ArrayXf worst = error.abs().reshaped(error.size() / sites, sites).colwise().maxCoeff();
    std::vector<Eigen::Index> order(static_cast<std::size_t>(sites));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::ranges::stable_sort(order, std::greater{}, [&](Eigen::Index site) { return worst[site]; });
    std::vector<Texel> found;
    for (std::size_t i = 0; i < std::min(worst_count, order.size()); ++i)
        found.push_back(texels[static_cast<std::size_t>(order[i]) * texels_per_site + texels_per_site / 2]);
    return found;
}

}  // namespace

std::vector<std::size_t> choose_terms(const KernelDecomposition& kernels, const Incidence& incidence,
                                      const LightTerms& light, double tolerance, Progress& progress, double work)
{
    std::vector<std::size_t> candidates(kernels.terms().size());
    std::iota(candidates.begin(), candidates.end(), std::size_t{0});
    if (light.changing.empty()) {  // all is to come
        progress.advance(work);
        return kernels.within(tolerance);
    }
    if (candidates.empty() || light.plane.texels() <= small_plane * small_plane)
        return candidates;

    const std::vector<std::size_t> lights = representatives(incidence);
    const RadianceProbe probe(light, lights, kernels.basis(candidates, rounding));
    std::vector<Texel> texels = probe_sites(light, lights, incidence);
    Readings readings;
    for (std::size_t round = 0;; ++round) {
        const std::size_t known = readings.size();
        readings.resize(texels.size());
        const std::size_t sites = (texels.size() - known) / texels_per_site;
        const double part = work / static_cast<double>((refinements + 1) * sites);
        parallel_for(sites, [&](std::size_t i) {
            const std::size_t first = known + i * texels_per_site;
            std::ranges::move(probe.read(std::span(texels).subspan(first, texels_per_site)),
                              readings.begin() + static_cast<std::ptrdiff_t>(first));
            progress.advance(part);
        });
        auto [kept, error] = leave_out(relative_parts(readings, kernels.terms(), tolerance), kernels.terms());
        if (round == refinements)
            return kept;
        const std::vector<Texel> more = sites_around(worst_sites(texels, error), light.plane, round);
        texels.insert(texels.end(), more.begin(), more.end());
    }
}

}  // namespace beamspread
