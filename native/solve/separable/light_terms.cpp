#include "solve/separable/light_terms.h"

#include <algorithm>
#include <cmath>

#include "simd/loops.h"
#include "solve/problem/beam_loops.h"
#include "solve/problem/directions.h"

namespace beamspread {

namespace {

// Texels of a row whose values stay in the cache from step to step.
constexpr std::size_t texels_at_once = 512;

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
        for (auto* values : {&row.part, &row.cos_beta, &row.sin_beta, &row.cosine, &row.sine, &row.u})
            values->resize(span.width);
        row.step.resize(span.width);
        const std::size_t steps = basis.functions.front().values.size() - 1;
        const double per_step =
            basis.last > basis.first ? static_cast<double>(steps) / (basis.last - basis.first) : 0.0;
        for (std::size_t x = 0; x < span.width; x += texels_at_once) {
            const std::size_t count = std::min(texels_at_once, span.width - x);
            copy_row(light.irradiance, span.y, span.x + x, count, row.cosine.data() + x);
            std::fill_n(row.sine.data() + x, count, 0.0f);
            const float* directions = light.directions.field + 3 * (span.y * light.irradiance.width + span.x + x);
            find_angles(directions, row.cosine.data() + x, row.cos_beta.data() + x, row.sin_beta.data() + x,
                        row.u.data() + x, count);
            find_steps(row.step.data() + x, row.part.data() + x, row.u.data() + x, static_cast<float>(basis.first),
                       static_cast<float>(per_step), static_cast<std::uint32_t>(steps), count);
        }
    }
}

void TermRow::evaluate(const LightTerms& terms, std::size_t t, float* values)
{
    const LightTerm& term = terms.terms[t];
    if (term.fixed) {
        copy_row(terms.fixed[*term.fixed].irradiance, m_span.y, m_span.x, m_span.width, values);
        return;
    }
    const LowRankBasis::AngleFunction& function = terms.basis.functions[term.function];
    for (std::size_t x = 0; x < m_span.width; x += texels_at_once) {
        const std::size_t count = std::min(texels_at_once, m_span.width - x);
        for (Light& light : m_lights) {
            float* cosine = light.cosine.data() + x;
            float* sine = light.sine.data() + x;
            float* u = light.u.data() + x;
            for (std::size_t m = light.m; m < function.m; ++m)
                turn(cosine, sine, light.cos_beta.data() + x, light.sin_beta.data() + x, count);
            if (light.function != term.function)
                look_up(u, function.values.data(), light.step.data() + x, light.part.data() + x, count);
            const float* by_azimuth = term.phase == Phase::cosine ? cosine : sine;
            if (&light == m_lights.data())
                multiply(values + x, u, by_azimuth, count);
            else
                add_scaled_product(values + x, u, by_azimuth, 1.0f, count);
        }
    }
    for (Light& light : m_lights) {
        light.m = function.m;
        light.function = term.function;
    }
}

}  // namespace beamspread
