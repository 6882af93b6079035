#include "solve/separable/light_terms.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "simd/loops.h"

namespace beamspread {

namespace {

// Texels of a row whose values stay in the cache from step to step.
constexpr std::size_t texels_at_once = 512;

// Directions that have a term each. A basis for more of them needs hardly more terms than these would be.
constexpr std::size_t most_fixed_directions = 4;

// Every harmonic of a kernel whose beams travel toward azimuth beta.
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

// The lights of each direction.
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

// One direction's profile per medium; one light is transformed once for all its colours, several are added up first.
void add_direction(LightTerms& terms, const Vec3& travel, const std::vector<std::size_t>& lights, double beyond)
{
    const std::size_t first_profile = terms.profiles.size();
    for (const ChannelMedium& medium : terms.sets.media) {
        ScaledProfile profile{medium.ldf->profile(incidence_deg(travel), medium.albedo, Side::reflected),
                              medium.mean_free_path, 0.0};
        profile.reach = reach(profile.profile, medium.mean_free_path, std::min(beyond, 1e-6));
        terms.profiles.push_back(std::move(profile));
    }
    const bool alone = lights.size() == 1;
    for (std::size_t set = 0; set < (alone ? 1 : terms.sets.count()); ++set) {
        LightTerm term;
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
        const auto& [m, rank, values] = terms.basis.functions[f];
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t set = 0; set < terms.sets.count() && (m > 0 || phase == Phase::cosine); ++set) {
                LightTerm term{{}, f, phase, set, {}};
                for (const ChannelSets::Result& result : terms.sets.results) {
                    term.kernels.emplace_back();
                    if (result.set == set)
                        term.kernels.back() = {{first_profile[result.medium] + rank, m, phase, 1.0}};
                }
                terms.terms.push_back(std::move(term));
            }
    }
}

}  // namespace

LightTerms light_terms(const Problem& problem, double beyond, const TermChoice& choose)
{
    LightTerms result{problem.plane, ChannelSets(problem), {}, {}, {}, {}, {}, {}};
    for (const PlaneLight& light : problem.lights)
        (std::holds_alternative<OneDirection>(light.directions) ? result.fixed : result.changing).push_back(light);
    const auto directions = by_direction(result.fixed);
    if (directions.size() > most_fixed_directions)
        result.changing.insert(result.changing.end(), result.fixed.begin(), result.fixed.end());
    else
        for (const auto& [travel, lights] : directions)
            add_direction(result, travel, lights, beyond);
    for (const PlaneLight& light : result.changing) {
        result.colors.emplace_back();
        for (std::size_t set = 0; set < result.sets.count(); ++set)
            result.colors.back().push_back(static_cast<float>(result.sets.color(light, set)));
    }
    const Incidence incidence(problem.plane, result.changing);
    if (incidence.none())
        return result;
    const KernelDecomposition kernels(incidence, result.sets.media,
                                      std::max(problem.plane.pitch_x, problem.plane.pitch_y));
    add_basis(result, kernels.basis(choose(kernels, incidence, result), beyond));
    return result;
}

void TermRow::start(const LightTerms& terms, const RowSpan& span, std::size_t first, std::size_t count)
{
    m_width = span.width;
    m_first = first;
    m_values.assign(count * span.width, 0.0f);
    bool has_moments = false;
    for (std::size_t t = first; t < first + count; ++t) {
        has_moments |= terms.terms[t].fixed.empty();
        for (const auto& [light, weight] : terms.terms[t].fixed) {
            m_u.resize(span.width);
            copy_row(terms.fixed[light].irradiance, span.y, span.x, span.width, m_u.data());
            add_scaled(m_values.data() + (t - first) * m_width, m_u.data(), weight, span.width);
        }
    }
    if (!has_moments)
        return;
    for (std::size_t x = 0; x < span.width; x += texels_at_once) {
        const RowSpan part{span.y, span.x + x, std::min(texels_at_once, span.width - x)};
        for (std::size_t l = 0; l < terms.changing.size(); ++l)
            if (m_beams.read(terms.plane, terms.changing[l], part))
                add_moments(terms, {span.y, x, part.width}, terms.colors[l], first + count);
    }
}

// Of the beams of one light, to texels [span.x, ...) of the row.
void TermRow::add_moments(const LightTerms& terms, const RowSpan& span, const std::vector<float>& colors,
                          std::size_t end)
{
    const std::size_t count = span.width;
    m_step.resize(count);
    for (auto* values : {&m_part, &m_cosine, &m_sine, &m_u})
        values->resize(count);
    const LowRankBasis& basis = terms.basis;
    const std::size_t steps = basis.functions.front().values.size() - 1;
    const double per_step = basis.last > basis.first ? static_cast<double>(steps) / (basis.last - basis.first) : 0.0;
    find_steps(m_step.data(), m_part.data(), m_beams.half_tangent.data(), static_cast<float>(basis.first),
               static_cast<float>(per_step), static_cast<std::uint32_t>(steps), count);
    std::copy_n(m_beams.irradiance.data(), count, m_cosine.data());
    std::fill_n(m_sine.data(), count, 0.0f);
    std::size_t m = 0;
    std::optional<std::size_t> function;  // that m_u holds
    for (std::size_t t = m_first; t < end; ++t) {
        const LightTerm& term = terms.terms[t];
        if (!term.fixed.empty() || colors[term.set] == 0.0f)
            continue;
        const LowRankBasis::AngleFunction& wanted = basis.functions[term.function];
        for (; m < wanted.m; ++m)
            rotate(m_cosine.data(), m_sine.data(), m_beams.cos_beta.data(), m_beams.sin_beta.data(), count);
        if (function != term.function)
            look_up(m_u.data(), wanted.values.data(), m_step.data(), m_part.data(), count);
        function = term.function;
        add_scaled_product(m_values.data() + (t - m_first) * m_width + span.x, m_u.data(),
                           (term.phase == Phase::cosine ? m_cosine : m_sine).data(), colors[term.set], count);
    }
}

}  // namespace beamspread
