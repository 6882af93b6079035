#include "solve/separable/light_terms.h"

#include <algorithm>
#include <optional>

#include "simd/loops.h"

namespace beamspread {

namespace {

// Beams of a row that pass all steps together. More: more cache.
constexpr std::size_t beams_at_once = 512;

// Colors of added light, 0 in sets that follow from others.
std::vector<float> set_colors(const LightTerms& terms, const std::vector<double>& color)
{
    std::vector<float> colors;
    for (std::size_t set = 0; set < terms.sets.count(); ++set)
        colors.push_back(terms.sets.source(set) == set ? static_cast<float>(color[terms.sets.channel(set)]) : 0.0f);
    return colors;
}

}  // namespace

void BeamMoments::add(const LightTerms& terms, const BeamRow& beams, const std::vector<float>& colors,
                      std::size_t first, std::size_t end, const Values& values, const float* irradiance)
{
    const std::size_t count = beams.irradiance.size();
    // Moments follow the fixed terms, in the order of their functions.
    while (first < end && !terms.terms[first].is_moment())
        ++first;
    if (first == end)
        return;
    const std::size_t first_function = terms.terms[first].function;
    const std::size_t functions = terms.terms[end - 1].function + 1 - first_function;
    m_step.resize(count);
    for (auto* scratch : {&m_part, &m_cosine, &m_sine, &m_product})
        scratch->resize(count);
    const LowRankBasis& basis = terms.basis;
    const double per_step =
        basis.last > basis.first ? static_cast<double>(basis.steps) / (basis.last - basis.first) : 0.0;
    find_steps(m_step.data(), m_part.data(), beams.half_tangent.data(), static_cast<float>(basis.first),
               static_cast<float>(per_step), static_cast<std::uint32_t>(basis.steps), count);
    m_u.resize(functions * count);
    look_up(m_u.data(), functions, basis.table.data() + first_function, basis.functions.size(), m_step.data(),
            m_part.data(), count);
    if (irradiance)
        std::fill_n(m_cosine.data(), count, 1.0f);
    else
        std::copy_n(beams.irradiance.data(), count, m_cosine.data());
    std::fill_n(m_sine.data(), count, 0.0f);
    std::size_t m = 0;
    std::optional<std::size_t> function;  // of the product in m_product
    std::optional<Phase> phase;
    for (std::size_t t = first; t < end; ++t) {
        const LightTerm& term = terms.terms[t];
        if (colors[term.set] == 0.0f)
            continue;
        for (; m < basis.functions[term.function].m; ++m)
            rotate(m_cosine.data(), m_sine.data(), beams.cos_beta.data(), beams.sin_beta.data(), count);
        if (function != term.function || phase != term.phase)
            multiply(m_product.data(), m_u.data() + (term.function - first_function) * count,
                     (term.phase == Phase::cosine ? m_cosine : m_sine).data(), count);
        function = term.function;
        phase = term.phase;
        if (irradiance)
            add_scaled_product(values(t), m_product.data(), irradiance + term.set * count, colors[term.set], count);
        else
            add_scaled(values(t), m_product.data(), colors[term.set], count);
    }
}

std::vector<float> factors_of_directions(const LightTerms& terms, std::span<const Vec3f> travel,
                                         const std::vector<double>& color)
{
    const std::size_t count = travel.size();
    BeamRow beams;
    beams.irradiance.assign(count, 1.0f);
    for (auto* values : {&beams.cos_beta, &beams.sin_beta, &beams.half_tangent})
        values->resize(count);
    find_angles(&travel.data()->x, beams.irradiance.data(), beams.cos_beta.data(), beams.sin_beta.data(),
                beams.half_tangent.data(), count);
    std::vector<float> factors(terms.terms.size() * count);
    BeamMoments().add(terms, beams, set_colors(terms, color), 0, terms.terms.size(),
                      [&](std::size_t t) { return factors.data() + t * count; });
    return factors;
}

void TermRow::start(const LightTerms& terms, const RowSpan& span, std::size_t first, std::size_t count,
                    std::size_t step)
{
    m_values.assign(count * span.width, 0.0f);
    bool has_moments = false;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t t = first + i * step;
        float* row = m_values.data() + i * span.width;
        has_moments |= terms.terms[t].is_moment();
        for (const auto& [light, weight] : terms.terms[t].fixed) {
            m_light.resize(span.width);
            copy_row(terms.fixed[light].irradiance, span.y, span.x, span.width, m_light.data());
            add_scaled(row, m_light.data(), weight, span.width);
        }
        if (const float* added = terms.moments.plane(t)) {
            const auto factor = static_cast<float>(terms.sets.source_factor(terms.terms[t].set));
            scale(row, added + span.y * terms.plane.width + span.x, factor, span.width);
        }
    }
    const std::size_t end = first + (count - 1) * step + 1;
    for (std::size_t x = 0; x < span.width && has_moments; x += beams_at_once) {
        const RowSpan part{span.y, span.x + x, std::min(beams_at_once, span.width - x)};
        for (std::size_t l = 0; l < terms.changing.size(); ++l) {
            if (!m_beams.read(terms.plane, terms.changing[l], part))
                continue;
            m_colors = terms.colors[l];
            for (std::size_t set = 0; set < m_colors.size() && step > 1; ++set)
                if (set != terms.terms[first].set)
                    m_colors[set] = 0.0f;
            m_moments.add(terms, m_beams, m_colors, first, end,
                          [&](std::size_t t) { return m_values.data() + (t - first) / step * span.width + x; });
        }
    }
    if (terms.entering)
        enter(terms, span, first, count, step);
}

// Multiplies light by the factors by which it enters.
void TermRow::enter(const LightTerms& terms, const RowSpan& span, std::size_t first, std::size_t count,
                    std::size_t step)
{
    const std::size_t sets = terms.sets.count();
    m_entering.resize(sets * span.width);
    for (std::size_t set = 0; set < sets; ++set)
        for (std::size_t x = 0; x < span.width; ++x)
            m_entering[set * span.width + x] = terms.entering_factor(set, span.y, span.x + x);
    for (std::size_t i = 0; i < count; ++i) {
        float* row = m_values.data() + i * span.width;
        multiply(row, row, m_entering.data() + terms.terms[first + i * step].set * span.width, span.width);
    }
}

void MomentSum::add(LightTerms& terms, const RayRow& rays, const std::vector<double>& color, bool is_colored)
{
    const std::size_t channels = color.size();
    const std::size_t sets = terms.sets.count();
    m_colors = set_colors(terms, color);
    for (std::size_t x = 0; x < rays.width; x += beams_at_once) {
        const RowSpan span{rays.y, rays.x + x, std::min(beams_at_once, rays.width - x)};
        const float* irradiance = rays.irradiance + x * channels;
        for (auto* values : {&m_beams.irradiance, &m_beams.cos_beta, &m_beams.sin_beta, &m_beams.half_tangent})
            values->resize(span.width);
        for (std::size_t i = 0; i < span.width; ++i)  // the largest channel; rays of 0 may have no direction
            m_beams.irradiance[i] = *std::max_element(irradiance + i * channels, irradiance + (i + 1) * channels);
        if (std::all_of(m_beams.irradiance.begin(), m_beams.irradiance.end(), [](float e) { return e == 0.0f; }))
            continue;
        find_angles(rays.travel + 3 * x, m_beams.irradiance.data(), m_beams.cos_beta.data(), m_beams.sin_beta.data(),
                    m_beams.half_tangent.data(), span.width);
        if (!is_colored) {
            add_beams(terms, span);
            continue;
        }
        m_irradiance.resize(sets * span.width);
        for (std::size_t set = 0; set < sets; ++set) {
            const std::size_t channel = terms.sets.channel(set);
            for (std::size_t i = 0; i < span.width; ++i)
                m_irradiance[set * span.width + i] = irradiance[i * channels + channel];
        }
        add_beams(terms, span, m_irradiance.data());
    }
}

void MomentSum::add_beams(LightTerms& terms, const RowSpan& span, const float* irradiance)
{
    const std::size_t first = span.y * terms.plane.width + span.x;
    m_moments.add(
        terms, m_beams, m_colors, 0, terms.terms.size(), [&](std::size_t t) { return terms.moments.plane(t) + first; },
        irradiance);
}

}  // namespace beamspread
