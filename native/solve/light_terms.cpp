#include "solve/light_terms.h"

#include <algorithm>
#include <cmath>

#include "solve/beam_basis.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// Every harmonic of a kernel whose beams travel toward azimuth beta.
std::vector<KernelTerm> fixed_kernel(std::size_t profile, std::size_t harmonics, double beta)
{
    std::vector<KernelTerm> kernel;
    for (const std::size_t first : {std::size_t{0}, std::size_t{1}})
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t m = first; m < harmonics; m += 2)
                if (m > 0 || phase == Phase::cosine) {
                    const double turned = static_cast<double>(m) * beta;
                    kernel.push_back({profile, m, phase, phase == Phase::cosine ? std::cos(turned) : std::sin(turned)});
                }
    return kernel;
}

void add_basis(LightTerms& terms, LowRankBasis basis)
{
    terms.basis = std::move(basis);
    std::vector<std::size_t> first_profile;
    for (const std::vector<ScaledProfile>& profiles : terms.basis.profiles) {
        first_profile.push_back(terms.profiles.size());
        terms.profiles.insert(terms.profiles.end(), profiles.begin(), profiles.end());
    }
    for (std::size_t f = 0; f < terms.basis.functions.size(); ++f) {
        const auto& [m, rank, values] = terms.basis.functions[f];
        for (const Phase phase : {Phase::cosine, Phase::sine}) {
            if (m == 0 && phase == Phase::sine)
                continue;
            LightTerm term{std::nullopt, f, phase, {}};
            for (const std::size_t profile : first_profile)
                term.kernels.push_back({{profile + rank, m, phase, 1.0}});
            terms.terms.push_back(std::move(term));
        }
    }
}

}  // namespace

LightTerms light_terms(const std::vector<LightField>& lights, const std::vector<KernelMedium>& media, double texel,
                       double beyond, const TermChoice& choose)
{
    LightTerms result;
    for (const LightField& light : lights)
        (light.directions.field != nullptr ? result.changing : result.fixed).push_back(light);

    for (std::size_t l = 0; l < result.fixed.size(); ++l) {
        LightTerm term{l, 0, Phase::cosine, {}};
        const Vec3& direction = result.fixed[l].directions.uniform;
        for (const KernelMedium& medium : media) {
            ScaledProfile profile{medium.library->profile(incidence_deg(direction), medium.albedo, Side::reflected),
                                  medium.mean_free_path, 0.0};
            profile.reach = reach(profile.profile, medium.mean_free_path, std::min(beyond, 1e-6));
            term.kernels.push_back(
                fixed_kernel(result.profiles.size(), profile.profile.harmonics(), azimuth(direction)));
            result.profiles.push_back(std::move(profile));
        }
        result.terms.push_back(std::move(term));
    }
    if (result.changing.empty())
        return result;
    const std::vector<LightPyramid> pyramids(result.changing.begin(), result.changing.end());
    AngleCounts angles;
    for (const LightPyramid& pyramid : pyramids)
        angles.add(pyramid.angles());
    const PresentAngles present(angles);
    if (present.none())
        return result;
    const KernelDecomposition kernels(present, media, texel);
    add_basis(result, kernels.basis(choose(kernels, pyramids), beyond));
    return result;
}

void TermRow::start(const LightTerms& terms, const RowSpan& span)
{
    m_span = span;
    m_lights.resize(terms.basis.functions.empty() ? 0 : terms.changing.size());
    const LowRankBasis& basis = terms.basis;
    for (std::size_t l = 0; l < m_lights.size(); ++l) {
        Light& row = m_lights[l];
        const LightField& light = terms.changing[l];
        row.m = 0;
        row.function.reset();
        row.u.resize(span.width);
        for (auto* values : {&row.part, &row.cos_beta, &row.sin_beta, &row.cosine, &row.sine})
            values->resize(span.width);
        row.step.resize(span.width);
        const std::size_t steps = basis.functions.front().values.size() - 1;
        const double per_step =
            basis.last > basis.first ? static_cast<double>(steps) / (basis.last - basis.first) : 0.0;
        for (std::size_t i = 0; i < span.width; ++i)
            row.cosine[i] = light.irradiance(span.y, span.x + i);
        std::fill(row.sine.begin(), row.sine.end(), 0.0f);
        const float* directions = light.directions.field + 3 * (span.y * light.irradiance.width + span.x);
        find_angles(directions, row.cosine.data(), row.cos_beta.data(), row.sin_beta.data(), row.u.data(), span.width);
        find_steps(row.step.data(), row.part.data(), row.u.data(), static_cast<float>(basis.first),
                   static_cast<float>(per_step), static_cast<std::uint32_t>(steps), span.width);
    }
}

void TermRow::evaluate(const LightTerms& terms, std::size_t t, float* values)
{
    const LightTerm& term = terms.terms[t];
    if (term.fixed) {
        const View2D<const float>& irradiance = terms.fixed[*term.fixed].irradiance;
        for (std::size_t i = 0; i < m_span.width; ++i)
            values[i] = irradiance(m_span.y, m_span.x + i);
        return;
    }
    const LowRankBasis::AngleFunction& function = terms.basis.functions[term.function];
    std::fill_n(values, m_span.width, 0.0f);
    for (Light& light : m_lights) {
        for (; light.m < function.m; ++light.m)
            turn(light.cosine.data(), light.sine.data(), light.cos_beta.data(), light.sin_beta.data(), m_span.width);
        const std::vector<float>& by_azimuth = term.phase == Phase::cosine ? light.cosine : light.sine;
        if (light.function != term.function)
            look_up(light.u.data(), function.values.data(), light.step.data(), light.part.data(), m_span.width);
        light.function = term.function;
        add_scaled_product(values, light.u.data(), by_azimuth.data(), 1.0f, m_span.width);
    }
}

}  // namespace beamspread
