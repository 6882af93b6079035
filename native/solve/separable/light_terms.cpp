#include "solve/separable/light_terms.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Largest number of directions with a term each. Larger: less time for few directions, more for many.
constexpr std::size_t max_fixed_directions = 16;

// Texels that planes of moments are moved apart by: rays are added to about as many at once.
constexpr std::size_t texels_apart = 64;

// All harmonics of a kernel for beams that travel toward azimuth beta.
std::vector<KernelTerm> fixed_kernel(std::size_t profile, std::size_t harmonics, double beta, double factor)
{
    std::vector<KernelTerm> kernel;
    for (const std::size_t first : {std::size_t{0}, std::size_t{1}})
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t m = first; m < harmonics; m += 2)
                if (m > 0 || phase == Phase::cosine) {
                    const double turned = static_cast<double>(m) * beta;
                    const double part = phase == Phase::cosine ? std::cos(turned) : std::sin(turned);
                    kernel.push_back({profile, m, phase, factor * part});
                }
    return kernel;
}

// Directions, each with the indices of its lights.
std::vector<std::pair<Vec3, std::vector<std::size_t>>> by_direction(const std::vector<PlaneLight>& lights)
{
    std::vector<std::pair<Vec3, std::vector<std::size_t>>> groups;
    for (std::size_t l = 0; l < lights.size(); ++l) {
        const Vec3 travel = std::get<OneDirection>(lights[l].directions).travel;
        const auto known =
            std::find_if(groups.begin(), groups.end(), [&](const auto& group) { return group.first == travel; });
        if (known == groups.end())
            groups.push_back({travel, {l}});
        else
            known->second.push_back(l);
    }
    return groups;
}

// Adds the terms of one direction: a single light has one term for all its colours; several lights are summed in one
// term per set.
void add_direction(LightTerms& terms, const Vec3& travel, const std::vector<std::size_t>& lights, double beyond)
{
    const std::size_t first_profile = terms.profiles.size();
    for (const ChannelMedium& medium : terms.sets.media) {
        ScaledProfile profile{medium.ldf->profile(incidence_deg(travel), medium.albedo, medium.side),
                              medium.mean_free_path, 0.0};
        constexpr double max_beyond = 1e-6;  // fraction of power; smaller: smaller errors of suns, more padding
        profile.reach = profile.profile.reach(std::min(beyond, max_beyond)) * medium.mean_free_path;
        terms.profiles.push_back(std::move(profile));
    }
    const bool alone = lights.size() == 1 && !terms.have_sets_apart();
    for (std::size_t set = 0; set < (alone ? 1 : terms.sets.count()); ++set) {
        LightTerm term;
        term.set = set;
        for (const std::size_t l : lights)
            term.fixed.push_back({l, alone ? 1.0f : static_cast<float>(terms.sets.color(terms.fixed[l], set))});
        for (const ChannelSets::Result& result : terms.sets.results) {
            const double factor = alone               ? terms.sets.color(terms.fixed[lights.front()], result.set)
                                  : result.set == set ? 1.0
                                                      : 0.0;
            const std::size_t profile = first_profile + result.medium;
            term.kernels.emplace_back();
            if (factor > 0.0)
                term.kernels.back() =
                    fixed_kernel(profile, terms.profiles[profile].profile.harmonics(), azimuth(travel), factor);
        }
        terms.terms.push_back(std::move(term));
    }
}

void add_basis(LightTerms& terms, LowRankBasis basis)
{
    terms.basis = std::move(basis);
    std::vector<std::size_t> first_profile;  // [medium]
    for (const std::vector<ScaledProfile>& profiles : terms.basis.profiles) {
        first_profile.push_back(terms.profiles.size());
        terms.profiles.insert(terms.profiles.end(), profiles.begin(), profiles.end());
    }
    for (std::size_t f = 0; f < terms.basis.functions.size(); ++f) {
        const auto& [m, rank] = terms.basis.functions[f];
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t set = 0; set < terms.sets.count() && (m > 0 || phase == Phase::cosine); ++set) {
                LightTerm term{{}, f, phase, set, {}, terms.terms.size() - set + terms.sets.source(set)};
                for (const ChannelSets::Result& result : terms.sets.results) {
                    term.kernels.emplace_back();
                    if (result.set == set)
                        term.kernels.back() = {{first_profile[result.medium] + rank, m, phase, 1.0}};
                }
                terms.terms.push_back(std::move(term));
            }
    }
}

void check_memory(const Problem& problem, std::size_t bytes)
{
    if (problem.max_moment_bytes == 0 || bytes <= problem.max_moment_bytes)
        return;
    const auto in_gigabytes = [](std::size_t of) { return std::ldexp(static_cast<double>(of), -30); };
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << "their light takes " << in_gigabytes(bytes) << " GB of memory, where "
         << in_gigabytes(problem.max_moment_bytes) << " GB are left for it";
    throw MemoryLimit(text.str());
}

}  // namespace

MomentPlanes::MomentPlanes(const std::vector<LightTerm>& terms, std::size_t texels,
                           const std::function<void()>& advance)
    : m_texels(texels)
{
    for (std::size_t t = 0; t < terms.size(); ++t)
        if (terms[t].is_moment() && terms[t].source == t)
            m_own.push_back(t);
    // Planes a power of two apart would share few lines of the cache.
    const std::size_t stride = (texels + texels_apart - 1) / texels_apart * texels_apart + texels_apart;
    m_data = HugePages<float>(m_own.size() * stride);
    m_planes.resize(terms.size());
    for (std::size_t i = 0; i < m_own.size(); ++i)
        m_planes[m_own[i]] = m_data.data() + i * stride;
    for (std::size_t t = 0; t < terms.size(); ++t)
        if (terms[t].is_moment())
            m_planes[t] = m_planes[terms[t].source];
    clear(advance);
}

void MomentPlanes::clear(const std::function<void()>& advance)
{
    parallel_for(m_own.size(), [&](std::size_t i) {
        std::fill_n(m_planes[m_own[i]], m_texels, 0.0f);
        if (advance)
            advance();
    });
}

LightTerms light_terms(const Problem& problem, double beyond, const TermChoice& choose)
{
    LightTerms result{.plane = problem.plane,
                      .sets = ChannelSets(problem),
                      .fixed = {},
                      .changing = {},
                      .colors = {},
                      .basis = {},
                      .terms = {},
                      .profiles = {},
                      .moments = {},
                      .entering = problem.entering,
                      .channels = problem.channels.size()};
    for (const PlaneLight& light : problem.lights)
        (std::holds_alternative<OneDirection>(light.directions) ? result.fixed : result.changing).push_back(light);
    const auto directions = by_direction(result.fixed);
    if (directions.size() > max_fixed_directions)
        result.changing.insert(result.changing.end(), result.fixed.begin(), result.fixed.end());
    else
        for (const auto& [travel, lights] : directions)
            add_direction(result, travel, lights, beyond);
    const std::size_t stored = result.changing.size();
    result.changing.insert(result.changing.end(), problem.coming.examples.begin(), problem.coming.examples.end());
    for (const PlaneLight& light : result.changing) {
        result.colors.emplace_back();
        for (std::size_t set = 0; set < result.sets.count(); ++set)
            result.colors.back().push_back(static_cast<float>(result.sets.color(light, set)));
    }
    const Incidence incidence(problem.plane, result.changing, problem.coming);
    const auto drop_examples = [&] {
        result.changing.resize(stored);
        result.colors.resize(stored);
    };
    if (incidence.none()) {
        drop_examples();
        return result;
    }
    const KernelDecomposition kernels(incidence, result.sets.media,
                                      std::max(problem.plane.pitch_x, problem.plane.pitch_y));
    add_basis(result, kernels.basis(choose(kernels, incidence, result), beyond));
    drop_examples();
    if (!problem.coming.survey.empty()) {
        std::size_t kept = 0;
        for (std::size_t t = 0; t < result.terms.size(); ++t)
            kept += result.terms[t].is_moment() && result.terms[t].source == t ? 1 : 0;
        check_memory(problem, kept * problem.plane.texels() * sizeof(float));
    }
    return result;
}

}  // namespace beamspread
