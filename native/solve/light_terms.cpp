#include "solve/light_terms.h"

#include <algorithm>
#include <cmath>

#include "solve/beam_basis.h"

namespace beamspread {

namespace {

// Every harmonic of a kernel whose beams travel toward azimuth beta.
std::vector<KernelTerm> fixed_kernel(std::size_t profile, double beta)
{
    std::vector<KernelTerm> kernel;
    for (const std::size_t first : {std::size_t{0}, std::size_t{1}})
        for (const Phase phase : {Phase::cosine, Phase::sine})
            for (std::size_t m = first; m < harmonic_count; m += 2)
                if (m > 0 || phase == Phase::cosine) {
                    const double turned = static_cast<double>(m) * beta;
                    kernel.push_back({profile, m, phase, phase == Phase::cosine ? std::cos(turned) : std::sin(turned)});
                }
    return kernel;
}

}  // namespace

LightTerms light_terms(const std::vector<LightField>& lights, const std::vector<KernelMedium>& media, double texel,
                       double tolerance)
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
            profile.reach = reach(profile.profile, medium.mean_free_path, std::min(1e-6, 1e-3 * tolerance));
            term.kernels.push_back(fixed_kernel(result.profiles.size(), azimuth(direction)));
            result.profiles.push_back(std::move(profile));
        }
        result.terms.push_back(std::move(term));
    }
    if (result.changing.empty())
        return result;
    result.basis = low_rank_basis(result.changing, media, texel, tolerance);
    std::vector<std::size_t> first_profile;
    for (const std::vector<ScaledProfile>& profiles : result.basis.profiles) {
        first_profile.push_back(result.profiles.size());
        result.profiles.insert(result.profiles.end(), profiles.begin(), profiles.end());
    }
    for (std::size_t f = 0; f < result.basis.functions.size(); ++f) {
        const auto& [m, rank, values] = result.basis.functions[f];
        for (const Phase phase : {Phase::cosine, Phase::sine}) {
            if (m == 0 && phase == Phase::sine)
                continue;
            LightTerm term{std::nullopt, f, phase, {}};
            for (const std::size_t profile : first_profile)
                term.kernels.push_back({{profile + rank, m, phase, 1.0}});
            result.terms.push_back(std::move(term));
        }
    }
    return result;
}

void term_rows(const LightTerms& terms, std::size_t first, std::size_t count, std::size_t y, float* values,
               std::size_t stride)
{
    const std::size_t last = first + count;
    bool any_changing = false;
    for (std::size_t t = first; t < last; ++t) {
        const LightTerm& term = terms.terms[t];
        float* out = values + (t - first) * stride;
        if (!term.fixed) {
            any_changing = true;
            continue;
        }
        const View2D<const float>& irradiance = terms.fixed[*term.fixed].irradiance;
        for (std::size_t x = 0; x < irradiance.width; ++x)
            out[x] = irradiance(y, x);
    }
    if (!any_changing)
        return;

    const LowRankBasis& basis = terms.basis;
    const std::size_t width = terms.changing.front().irradiance.width;
    const std::size_t steps = basis.functions.front().values.size() - 1;
    const double span = basis.last - basis.first;
    const double per_step = span > 0.0 ? static_cast<double>(steps) / span : 0.0;
    std::vector<std::size_t> step(width);
    std::vector<float> part(width);
    std::vector<float> cos_beta(width);
    std::vector<float> sin_beta(width);
    std::vector<float> cosine(width);  // cos(m beta), sin(m beta) times irradiance
    std::vector<float> sine(width);
    for (std::size_t l = 0; l < terms.changing.size(); ++l) {
        const LightField& light = terms.changing[l];
        const bool add = l > 0;
        for (std::size_t x = 0; x < width; ++x) {
            cosine[x] = light.irradiance(y, x);
            sine[x] = 0.0f;
            const float* d = light.directions.field + 3 * (y * width + x);
            const bool lit = cosine[x] != 0.0f;
            const double dx = lit ? static_cast<double>(d[0]) : 0.0;
            const double dy = lit ? static_cast<double>(d[1]) : 0.0;
            const double dz = lit ? static_cast<double>(d[2]) : -1.0;
            const double across = std::sqrt(dx * dx + dy * dy);
            cos_beta[x] = across > 0.0 ? static_cast<float>(dx / across) : 1.0f;
            sin_beta[x] = across > 0.0 ? static_cast<float>(dy / across) : 0.0f;
            const double place =
                std::clamp((half_tangent(dx, dy, dz) - basis.first) * per_step, 0.0, static_cast<double>(steps));
            step[x] = std::min(static_cast<std::size_t>(place), steps - 1);
            part[x] = static_cast<float>(place - static_cast<double>(step[x]));
        }
        std::size_t m = 0;
        for (std::size_t t = first; t < last; ++t) {
            const LightTerm& term = terms.terms[t];
            if (term.fixed)
                continue;
            const LowRankBasis::AngleFunction& function = basis.functions[term.function];
            for (; m < function.m; ++m) {
                for (std::size_t x = 0; x < width; ++x) {
                    const float next = cosine[x] * cos_beta[x] - sine[x] * sin_beta[x];
                    sine[x] = sine[x] * cos_beta[x] + cosine[x] * sin_beta[x];
                    cosine[x] = next;
                }
            }
            const float* table = function.values.data();
            const std::vector<float>& by_azimuth = term.phase == Phase::cosine ? cosine : sine;
            float* out = values + (t - first) * stride;
            for (std::size_t x = 0; x < width; ++x) {
                const float u = table[step[x]] + part[x] * (table[step[x] + 1] - table[step[x]]);
                out[x] = (add ? out[x] : 0.0f) + u * by_azimuth[x];
            }
        }
    }
}

}  // namespace beamspread
