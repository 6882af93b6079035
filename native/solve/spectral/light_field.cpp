#include "solve/spectral/light_field.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"
#include "solve/spectral/convolution.h"
#include "solve/spectral/part_convolution.h"
#include "solve/term_choice/choose_terms.h"

namespace beamspread {

namespace {

// Largest fraction of a kernel's power outside its reach, for changing directions. Larger: less padding, larger errors
// in the dark.
constexpr double max_beyond = 1e-5;

double nodes(const PaddedPlane& plane)
{
    return static_cast<double>(plane.padded_width) * static_cast<double>(plane.padded_height);
}

// The largest numbers of terms and of results that are spread together.
LevelChoice level_choice(const Problem& problem, const LightTerms& light)
{
    LevelChoice choice{problem.memory, light.terms.size(), light.sets.results.size(), problem.coarsening};
    if (light.have_sets_apart()) {
        choice.terms /= light.sets.count();
        choice.media = 0;
        for (std::size_t set = 0; set < light.sets.count(); ++set)
            choice.media = std::max(choice.media, light.sets.results_of(set).size());
    }
    return choice;
}

LightTerms chosen_terms(const Problem& problem, Progress& progress)
{
    const auto choose = [&](const KernelDecomposition& kernels, const Incidence& incidence, const LightTerms& light) {
        return choose_terms(kernels, incidence, light, problem.coming, problem.tolerance, progress, choice_work);
    };
    std::optional<LightTerms> result;
    with_threads(problem.threads, [&] {
        validate(problem);
        result = light_terms(problem, std::min(1e-2 * problem.tolerance, max_beyond), choose);
        if (!problem.coming.survey.empty())  // zeros of large planes take long enough to cancel
            result->moments = MomentPlanes(result->terms, problem.plane.texels(), [&] { progress.advance(0.0); });
    });
    return *std::move(result);
}

}  // namespace

LightField::LightField(const Problem& problem, Progress& progress)
    : m_problem(problem),
      m_terms(chosen_terms(problem, progress)),
      m_levels(choose_levels(problem.plane, m_terms.profiles, level_choice(problem, m_terms)))
{
    if (!problem.coming.survey.empty())
        m_unscattered.emplace(problem);
    m_problem.coming = {};
}

void LightField::add(const RayRow& rays, const std::vector<double>& color, bool is_colored)
{
    m_sums.local().add(m_terms, rays, color, is_colored);
    if (m_unscattered)
        m_unscattered->add(rays, color);
}

std::vector<float> LightField::moment_factors(std::span<const Vec3f> travel, const std::vector<double>& color) const
{
    return factors_of_directions(m_terms, travel, color);
}

void LightField::add_moments(std::size_t term, const RowSpan& span, const float* factors, const float* values)
{
    float* sums = m_terms.moments.plane(term) + span.y * m_problem.plane.width + span.x;
    add_scaled_product(sums, factors, values, 1.0f, span.width);
}

void LightField::clear()
{
    with_threads(m_problem.threads, [&] { m_terms.moments.clear(); });
    if (m_unscattered)
        m_unscattered->clear();
}

void LightField::solve(Progress& progress, float* luminance)
{
    with_threads(m_problem.threads, [&] {
        spread(progress, luminance);
        add_unscattered(m_problem, luminance);
    });
    if (m_unscattered)
        m_unscattered->add_to(luminance);
    clip_negative(luminance, m_problem.plane.texels() * m_problem.channels.size());
}

// All terms together; or those of one set after the other if sets have light of their own, so that the spectra of a
// single one are in memory.
std::vector<LightField::TermGroup> LightField::groups() const
{
    if (!m_terms.have_sets_apart()) {
        TermGroup all{.terms = m_terms.terms, .results = std::vector<std::size_t>(m_terms.sets.results.size())};
        std::iota(all.results.begin(), all.results.end(), std::size_t{0});
        return {std::move(all)};
    }
    std::vector<TermGroup> result;
    const std::size_t sets = m_terms.sets.count();
    for (std::size_t set = 0; set < sets; ++set) {
        TermGroup& group = result.emplace_back(
            TermGroup{.terms = {}, .first = set, .step = sets, .results = m_terms.sets.results_of(set)});
        for (std::size_t t = set; t < terms(); t += sets) {
            LightTerm& term = group.terms.emplace_back(m_terms.terms[t]);
            term.kernels.clear();
            for (const std::size_t r : group.results)
                term.kernels.push_back(m_terms.terms[t].kernels[r]);
        }
    }
    return result;
}

// Light of the terms of a group at the texels.
MakeLightRow LightField::rows_of(const TermGroup& group) const
{
    return [&] {
        return [&, row = TermRow()](const RowSpan& span, std::size_t first, std::size_t count) mutable {
            row.start(m_terms, span, group.first + first * group.step, count, group.step);
            return TermValues{row.values(), span.width};
        };
    };
}

void LightField::spread(Progress& progress, float* luminance)
{
    std::fill_n(luminance, m_problem.plane.texels() * m_problem.channels.size(), 0.0f);
    if (m_terms.terms.empty())  // nothing is lit
        return;
    if (m_problem.plane.is_divided()) {
        const TermGroup all{.terms = {}, .results = {}};
        const auto add = [&](std::size_t result, const RowSpan& span, const float* values, double factor) {
            add_row(result, span, values, factor, luminance);
        };
        PartConvolution(m_terms, m_problem.memory).solve(rows_of(all), add, progress, 1.0);
        return;
    }
    const std::vector<TermGroup> all = groups();
    for (const TermGroup& group : all)
        spread(group, progress, 1.0 / static_cast<double>(all.size()), luminance);
}

void LightField::spread(const TermGroup& group, Progress& progress, double work, float* luminance)
{
    double share = 1.0;  // of the texels in the work
    std::optional<CoarseLuminance> coarse;
    if (m_levels.coarse) {
        share = nodes(m_levels.texels.plane);
        share /= share + nodes(m_levels.coarse->plane);
        coarse.emplace(spread_coarsely(group, *m_levels.coarse, progress, (1.0 - share) * work));
    }
    if (!m_spectra)
        m_spectra.emplace(m_levels.texels, m_terms.profiles, m_levels.outside_centre);
    Convolution convolution(*m_spectra, group.terms, group.results.size(), m_problem.memory);
    const auto store = [&](std::size_t result, const RowSpan& span, float* values, double factor) {
        if (coarse)
            coarse->grid.add_interpolated(coarse->nodes[result], span, values, m_scratch.local());
        add_row(group.results[result], span, values, factor, luminance);
    };
    convolution.solve(rows_of(group), store, progress, share * work);
}

LightField::CoarseLuminance LightField::spread_coarsely(const TermGroup& group, const Level& level, Progress& progress,
                                                        double work)
{
    const PaddedPlane& plane = level.plane;
    const CoarseGrid grid(plane, m_problem.plane.width, m_problem.plane.height);
    const std::size_t results = group.results.size();
    std::vector<std::vector<float>> sums(results, std::vector<float>(grid.nodes(), 0.0f));
    if (!m_coarse_spectra)
        m_coarse_spectra.emplace(level, m_terms.profiles, std::nullopt);
    const double size = nodes(m_levels.texels.plane);
    const auto add = [&](std::size_t result, const RowSpan& span, const float* values, double factor) {
        add_scaled(sums[result].data() + span.y * plane.width + span.x, values, static_cast<float>(factor * size),
                   span.width);
    };
    // Memory: light on the nodes, its spectra, which are as large, and spectra of the results.
    const std::size_t for_light = m_problem.memory / 4;
    const std::size_t for_spectra = m_problem.memory / 2;
    const std::size_t all = group.terms.size();
    const std::size_t at_once = std::clamp<std::size_t>(for_light / (grid.nodes() * sizeof(float)), 1, all);
    for (std::size_t first = 0; first < all; first += at_once) {
        const std::size_t count = std::min(at_once, all - first);
        const double part = work * static_cast<double>(count) / static_cast<double>(all);
        const std::vector<float> light = grid.spread(rows_of(group), first, count, progress, 0.5 * part);
        Convolution convolution(*m_coarse_spectra, std::span(group.terms).subspan(first, count), results, for_spectra);
        const auto row = [&](const RowSpan& span, std::size_t term, std::size_t /*count*/) {
            return TermValues{light.data() + term * grid.nodes() + span.y * plane.width + span.x, grid.nodes()};
        };
        convolution.solve([&] { return row; }, add, progress, 0.5 * part);
    }
    return {grid, std::move(sums)};
}

void LightField::add_row(std::size_t result, const RowSpan& span, const float* values, double factor,
                         float* luminance) const
{
    const std::size_t channels = m_problem.channels.size();
    for (const ChannelSets::Member& member : m_terms.sets.results[result].members) {
        const auto scaled = static_cast<float>(factor * inv_pi * member.factor);
        float* out = luminance + (span.y * m_problem.plane.width + span.x) * channels + member.channel;
        for (std::size_t x = 0; x < span.width; ++x)
            out[x * channels] += scaled * values[x];
    }
}

}  // namespace beamspread
