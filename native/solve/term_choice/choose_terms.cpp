#include "solve/term_choice/choose_terms.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>
#include <span>
#include <utility>

#include <Eigen/Dense>

#include "base/threads.h"
#include "solve/term_choice/radiance_probe.h"

namespace beamspread {

namespace {

// Side (square root of the number of texels) of planes up to which all terms are chosen. Larger: a choice for fewer
// planes, more transforms.
constexpr std::size_t max_untruncated_side = 192;

// Fraction of the tolerance that errors at the probed texels may use; the rest is for other texels and the probe's own
// error. Larger: fewer terms, larger errors.
constexpr double error_budget = 0.25;

// Number of refinement passes around the texels with the largest error, and sites in each. More: smaller errors, more
// time.
constexpr std::size_t refinements = 2;
constexpr std::size_t worst_count = 12;

// Error relative to the brightest texel that is always allowed: rounding of transforms in single precision.
constexpr double rounding = 5e-6;

// Number of lights that are probed, the brightest, which change most between texels. More: smaller errors, more time.
constexpr std::size_t max_probed_lights = 4;

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
    lights.resize(std::min(lights.size(), max_probed_lights));
    return lights;
}

// Each candidate's part of the radiance at the probed texels, [texel and result][candidate], in units of the allowed
// error.
Eigen::ArrayXXf relative_parts(const Readings& readings, std::size_t candidates, double tolerance)
{
    const std::size_t results = readings.front().size() / candidates;
    const std::size_t sites = readings.size() / texels_per_site;
    Eigen::ArrayXXf parts = Eigen::ArrayXXf::Zero(index(readings.size() * results), index(candidates));
    for (std::size_t r = 0; r < results; ++r) {
        std::vector<double> nearby(sites);
        for (std::size_t s = 0; s < sites; ++s) {
            double sum = 0.0;
            for (std::size_t i = s * texels_per_site; i < (s + 1) * texels_per_site; ++i)
                for (std::size_t c = 0; c < candidates; ++c)
                    sum += static_cast<double>(readings[i][r * candidates + c]);
            nearby[s] = std::max(sum, 0.0) / static_cast<double>(texels_per_site);
        }
        const double brightest = *std::max_element(nearby.begin(), nearby.end());
        for (std::size_t i = 0; i < readings.size(); ++i) {
            const double allowed = error_budget * tolerance * nearby[i / texels_per_site] + rounding * brightest;
            for (std::size_t c = 0; c < candidates && allowed > 0.0; ++c)
                parts(index(i * results + r), index(c)) =
                    static_cast<float>(static_cast<double>(readings[i][r * candidates + c]) / allowed);
        }
    }
    return parts;
}

// Drops terms in the order of their parts per transform, the smallest first, while no error exceeds 1. Returns the
// chosen terms, and the errors, [texel and result].
std::pair<std::vector<std::size_t>, Eigen::ArrayXf> drop_terms(const Eigen::ArrayXXf& parts,
                                                               const std::vector<KernelDecomposition::Term>& terms)
{
    // Sum fourth powers: the few texels with the largest parts decide whether a term is needed.
    std::vector<float> worth(terms.size());
    parallel_for(worth.size(), [&](std::size_t c) {
        worth[c] = parts.col(index(c)).square().square().sum() / (terms[c].m > 0 ? 2.0f : 1.0f);
    });
    std::vector<std::size_t> order(terms.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t c) { return worth[c]; });
    std::vector<std::size_t> chosen;
    Eigen::ArrayXf error = Eigen::ArrayXf::Zero(parts.rows());
    for (const std::size_t c : order) {
        Eigen::ArrayXf next = error + parts.col(index(c));
        if (next.abs().maxCoeff() <= 1.0f)
            error.swap(next);
        else
            chosen.push_back(c);
    }
    std::ranges::sort(chosen);
    return {std::move(chosen), std::move(error)};
}

// The middles of the sites with the largest errors.
std::vector<Texel> worst_sites(const std::vector<Texel>& texels, const Eigen::ArrayXf& error)
{
    const Eigen::Index sites = index(texels.size() / texels_per_site);
    const Eigen::ArrayXf worst = error.abs().reshaped(error.size() / sites, sites).colwise().maxCoeff();
    std::vector<Eigen::Index> order(static_cast<std::size_t>(sites));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::ranges::stable_sort(order, std::greater{}, [&](Eigen::Index site) { return worst[site]; });
    std::vector<Texel> middles;
    for (std::size_t i = 0; i < std::min(worst_count, order.size()); ++i)
        middles.push_back(texels[static_cast<std::size_t>(order[i]) * texels_per_site + texels_per_site / 2]);
    return middles;
}

}  // namespace

std::vector<std::size_t> choose_terms(const KernelDecomposition& kernels, const Incidence& incidence,
                                      const LightTerms& light, const ComingLight& coming, double tolerance,
                                      Progress& progress, double work)
{
    std::vector<std::size_t> candidates(kernels.terms().size());
    std::iota(candidates.begin(), candidates.end(), std::size_t{0});
    std::vector<std::size_t> smooth;
    if (!coming.smooth.empty())
        smooth = smooth_terms(kernels, coming, tolerance);
    if (light.changing.empty()) {  // light is added later
        progress.advance(work);
        return coming.smooth.empty() ? kernels.within(tolerance) : smooth;
    }
    if (candidates.empty() || light.plane.texels() <= max_untruncated_side * max_untruncated_side)
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
        auto [chosen, error] = drop_terms(relative_parts(readings, candidates.size(), tolerance), kernels.terms());
        if (round == refinements) {
            std::vector<std::size_t> both;
            std::ranges::set_union(chosen, smooth, std::back_inserter(both));
            return both;
        }
        const std::vector<Texel> more = sites_around(worst_sites(texels, error), light.plane, round);
        texels.insert(texels.end(), more.begin(), more.end());
    }
}

}  // namespace beamspread
