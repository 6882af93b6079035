#include "bake/bent_solution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/threads.h"

namespace beamspread {

namespace {

// Differences from interpolated values, over the tolerance, from which texels around are solved: those of the luminance,
// of the normals, and of the luminance by light that leaves within as many texels of where it enters as the step is wide.
// Those of luminance are relative to `visible_scale`. Larger: fewer texels, larger errors.
constexpr float largest_difference = 0.7f;
constexpr float largest_turn = 8.0f;
constexpr float largest_change = 1.0f;

// Luminance, over the largest one, that counts as black. Smaller: more texels are solved where it is dark.
constexpr float black = 1e-3f;

// Differences over the standard deviation of noise up to which they count as noise, where the medium spreads it farther than
// the texels that tell the others. Larger: fewer texels, and lights of a size whose shadows are less exact.
constexpr double noisy = 6.0;

// Part of the samples from which on all are solved at once: the sources of texels side by side are found faster.
constexpr double most_part = 0.7;

// Number of texels of a step on each side of such a texel that are solved, too: as many as cubics reach.
constexpr std::size_t spread_texels = 2;

// Marks in masks.
constexpr std::uint8_t alone = 1;    // has no others to be interpolated from
constexpr std::uint8_t rough = 2;    // differs from its interpolation
constexpr std::uint8_t in_row = 4;   // near such a one in the row
constexpr std::uint8_t around = 8;   // near such a one

// Scale of visible differences at a luminance, both over the largest luminance. The eye sees smaller differences in the
// dark, about in proportion to the root of the luminance.
float visible_scale(float luminance)
{
    return std::sqrt(std::abs(luminance) + black);
}

// Marks texels of a step near rough ones.
void spread_marks(const NestedTexels& texels, std::size_t step, std::vector<std::uint8_t>& mask)
{
    const auto spread = [&](std::size_t first, std::size_t count, std::size_t stride, std::uint8_t from,
                            std::uint8_t to) {
        std::size_t marked = 0;  // texels up to here
        for (std::size_t i = 0; i < count; ++i) {
            if ((mask[first + i * stride] & from) == 0)
                continue;
            const std::size_t end = std::min(count, i + spread_texels + 1);
            for (std::size_t k = std::max(marked, i > spread_texels ? i - spread_texels : 0); k < end; ++k)
                mask[first + k * stride] |= to;
            marked = end;
        }
    };
    const std::size_t columns = (texels.width() + step - 1) / step;
    const std::size_t rows = (texels.height() + step - 1) / step;
    parallel_for(rows, [&](std::size_t y) { spread(y * step * texels.width(), columns, step, rough, in_row); });
    parallel_for(columns, [&](std::size_t x) { spread(x * step, rows, step * texels.width(), in_row, around); });
}

}  // namespace

// Light of the field, and how exact its luminance has to be.
struct BentSolution::Light {
    const SurfaceField& field;
    Accuracy accuracy;
    float tolerance;
    std::vector<float> brightest;  // [channel] largest luminance

    // Standard deviations that count as noise at texels that are told by others at twice a step, over the mean.
    double noise(std::size_t step) const
    {
        const double least = *std::min_element(accuracy.texels.begin(), accuracy.texels.end());
        return least >= 4.0 * static_cast<double>(step * step) ? noisy * accuracy.noise : 0.0;
    }
};

BentSolution::BentSolution(const ReceiverGrid& grid, const BentSamples& samples, const NestedTexels* texels)
    : m_grid(grid), m_samples(samples), m_texels(texels)
{
}

bool BentSolution::is_first(std::size_t texel) const
{
    if (m_texels == nullptr || !m_texels->is_whole(texel) || m_samples.run_of(texel) != nullptr)
        return true;
    constexpr std::size_t step = NestedTexels::steps.front();
    return texel % m_grid.width % step == 0 && texel / m_grid.width % step == 0;
}

double BentSolution::least_part() const
{
    std::size_t count = 0;
    for (std::size_t i = 0; i < m_grid.texels(); ++i) {
        const BentSamples::Run* const run = m_samples.run_of(i);
        count += is_first(i) && (run == nullptr || run->first == i) ? m_samples.of_texel[i].count : 0;
    }
    return static_cast<double>(count) / static_cast<double>(m_samples.all.size());
}

// Marks texels of a step where light or normals change.
void BentSolution::mark_changes(std::size_t step, const Light& light, Mask& is_rough) const
{
    // Light that leaves within a step of where it enters changes like the light that enters; and all light that leaves, if
    // as much enters everywhere.
    const std::size_t results = light.field.results();
    std::vector<float> near(m_grid.texels() * results);
    std::vector<float> all(near.size());
    for (std::size_t r = 0; r < results; ++r) {
        const std::vector<SurfaceField::Weight> of_step =
            light.field.weights_within(static_cast<double>(step) * m_grid.pitch_x, r);
        const std::vector<SurfaceField::Weight> of_all =
            light.field.weights_within(std::numeric_limits<double>::max(), r);
        parallel_for(m_grid.height, [&](std::size_t y) {
            for (std::size_t i = y * m_grid.width; i < (y + 1) * m_grid.width; ++i) {
                if (!m_texels->is_whole(i))
                    continue;
                near[i * results + r] = light.field.exitance_within(of_step, m_samples.of_texel[i].begin);
                all[i * results + r] = light.field.exitance_within(of_all, m_samples.of_texel[i].begin);
            }
        });
    }
    std::vector<float> noise;  // [result]
    for (std::size_t r = 0; r < results; ++r)
        noise.push_back(static_cast<float>(light.noise(step) * mean_of(near, r, results)));
    m_texels->for_each(step, [&](const NestedTexels::Place& place) {
        const std::size_t texel = place.y * m_grid.width + place.x;
        const Stencil stencil = m_texels->stencil(place, step);
        if (stencil.count == 0) {
            is_rough[texel] |= alone;
            return;
        }
        const auto normal_of = [&](std::size_t i) { return m_grid.bent_texel(i).normal; };
        bool changes = glm::length(normal_of(texel) - stencil(normal_of)) > largest_turn * light.tolerance;
        for (std::size_t r = 0; r < results && !changes; ++r) {
            const auto near_of = [&](std::size_t i) { return near[i * results + r]; };
            changes = std::abs(near_of(texel) - stencil(near_of)) >
                      std::max(noise[r], largest_change * light.tolerance * visible_scale(all[texel * results + r]));
        }
        if (changes)
            is_rough[texel] |= rough;
    });
}

// Marks solved texels of a step that are not as larger steps tell, or of which none tell.
void BentSolution::mark_differences(std::size_t step, const Light& light, const float* luminance, Mask& is_rough) const
{
    const std::size_t channels = light.brightest.size();
    std::vector<float> noise;  // [channel] over the largest luminance
    for (std::size_t c = 0; c < channels; ++c)
        noise.push_back(
            light.brightest[c] > 0.0f
                ? static_cast<float>(light.noise(step / 2) / std::sqrt(light.accuracy.texels[c]) *
                                     mean_of(std::span(luminance, m_grid.texels() * channels), c, channels)) /
                      light.brightest[c]
                : 0.0f);
    m_texels->for_each(step, [&](const NestedTexels::Place& place) {
        const std::size_t texel = place.y * m_grid.width + place.x;
        if (m_is_solved[texel] == 0)
            return;
        const Stencil stencil = m_texels->stencil(place, step);
        bool differs = stencil.count == 0;
        for (std::size_t c = 0; c < channels && !differs; ++c) {
            if (!(light.brightest[c] > 0.0f))
                continue;
            const auto value_of = [&](std::size_t i) { return luminance[i * channels + c] / light.brightest[c]; };
            const float here = value_of(texel);
            differs = std::abs(here - stencil(value_of)) >
                      std::max(noise[c], largest_difference * light.tolerance * visible_scale(here));
        }
        if (differs)
            is_rough[texel] |= rough;
    });
}

// Mean of whole texels with a value, [texel][count].
double BentSolution::mean_of(std::span<const float> values, std::size_t index, std::size_t count) const
{
    double sum = 0.0;
    std::size_t texels = 0;
    for (std::size_t i = 0; i < m_grid.texels(); ++i)
        if (m_texels->is_whole(i) && values[i * count + index] > 0.0f) {
            sum += static_cast<double>(values[i * count + index]);
            ++texels;
        }
    return sum / static_cast<double>(std::max<std::size_t>(texels, 1));
}

// Returns the number of wanted samples: those of the first step, or marked ones of another step that are not solved.
std::size_t BentSolution::find_wanted(std::size_t step, const Mask& is_rough, Mask& is_wanted) const
{
    std::fill(is_wanted.begin(), is_wanted.end(), std::uint8_t{0});
    std::size_t count = 0;
    for (std::size_t i = 0; i < m_grid.texels(); ++i) {
        if (is_first(i) != (step == NestedTexels::steps.front()))
            continue;
        if (step != NestedTexels::steps.front() && (is_rough[i] == 0 || m_is_solved[i] != 0))
            continue;
        const BentSamples::Range& range = m_samples.of_texel[i];
        for (std::uint32_t k = range.begin; k < range.begin + range.count; ++k) {
            count += is_wanted[k] == 0 ? 1 : 0;
            is_wanted[k] = 1;
        }
    }
    return count;
}

// Mean of a texel's pieces.
float BentSolution::mean_of_pieces(std::size_t texel, std::size_t channel, std::size_t channels) const
{
    const BentSamples::Range& range = m_samples.of_texel[texel];
    float sum = 0.0f;
    for (std::size_t k = range.begin; k < range.begin + range.count; ++k)
        sum += m_values[k * channels + channel];
    return sum / static_cast<float>(range.count);
}

void BentSolution::solve_some(const Mask& is_wanted, SurfaceField& field, Progress& progress, float* luminance)
{
    const std::size_t channels = m_values.size() / m_samples.all.size();
    field.solve(is_wanted, progress, m_values.data());
    parallel_for(m_grid.height, [&](std::size_t y) {
        for (std::size_t i = y * m_grid.width; i < (y + 1) * m_grid.width; ++i) {
            const BentSamples::Range& range = m_samples.of_texel[i];
            if (range.count == 0 || is_wanted[range.begin] == 0)
                continue;
            m_is_solved[i] = 1;
            for (std::uint32_t k = range.begin; k < range.begin + range.count; ++k)
                if (field.is_beyond(k))
                    m_is_beyond[i] = 1;
            const auto [beside, weight] = m_samples.beside(i);
            for (std::size_t c = 0; c < channels; ++c) {
                const float own = mean_of_pieces(i, c, channels);
                luminance[i * channels + c] =
                    weight > 0.0f ? own + weight * (mean_of_pieces(beside, c, channels) - own) : own;
            }
        }
    });
}

void BentSolution::interpolate(std::size_t step, std::size_t channels, float* luminance)
{
    for (const bool between_two : {true, false})
        m_texels->for_each(step, [&](const NestedTexels::Place& place) {
            const std::size_t texel = place.y * m_grid.width + place.x;
            if (place.is_between_two != between_two || m_is_solved[texel] != 0)
                return;
            const Stencil stencil = m_texels->stencil(place, step);
            m_is_beyond[texel] = m_is_beyond[stencil.texel[0]];
            for (std::size_t c = 0; c < channels; ++c)
                luminance[texel * channels + c] =
                    std::max(0.0f, stencil([&](std::size_t i) { return luminance[i * channels + c]; }));
        });
}

void BentSolution::solve_all(SurfaceField& field, Progress& progress, float* luminance)
{
    solve_some(Mask(m_samples.all.size(), 1), field, progress, luminance);
}

void BentSolution::solve(SurfaceField& field, const Accuracy& accuracy, Progress& progress, float* luminance)
{
    const std::size_t texels = m_grid.texels();
    m_is_solved.assign(texels, 0);
    m_is_beyond.assign(texels, 0);
    field.gather();
    const Light light{field, accuracy, static_cast<float>(accuracy.tolerance), field.brightest()};
    const std::size_t channels = light.brightest.size();
    m_values.assign(m_samples.all.size() * channels, 0.0f);
    std::fill_n(luminance, texels * channels, 0.0f);
    if (m_texels == nullptr) {
        solve_all(field, progress, luminance);
        return;
    }
    Mask is_wanted(m_samples.all.size());
    std::array<Mask, NestedTexels::steps.size()> is_rough;
    std::array<double, NestedTexels::steps.size()> expected{};  // samples
    for (std::size_t s = 0; s < is_rough.size(); ++s) {
        is_rough[s].assign(texels, 0);
        if (s > 0) {
            mark_changes(NestedTexels::steps[s], light, is_rough[s]);
            spread_marks(*m_texels, NestedTexels::steps[s], is_rough[s]);
        }
        expected[s] = static_cast<double>(find_wanted(NestedTexels::steps[s], is_rough[s], is_wanted));
    }
    if (std::accumulate(expected.begin(), expected.end(), 0.0) >= most_part * static_cast<double>(is_wanted.size())) {
        solve_all(field, progress, luminance);
        return;
    }
    double left = 1.0;
    for (std::size_t s = 0; s < is_rough.size(); ++s) {
        const std::size_t step = NestedTexels::steps[s];
        expected[s] = static_cast<double>(find_wanted(step, is_rough[s], is_wanted));
        double work = 0.0;
        for (std::size_t k = s; k < is_rough.size(); ++k)
            work += expected[k];
        const double part = work > 0.0 ? left * expected[s] / work : left;
        left -= part;
        progress.advance_by(part, [&](Progress& some) {
            some.set_total(1.0);
            if (expected[s] > 0.0)
                solve_some(is_wanted, field, some, luminance);
        });
        if (s > 0)
            interpolate(step, channels, luminance);
        if (s + 1 == is_rough.size())
            break;
        mark_differences(step, light, luminance, is_rough[s + 1]);
        spread_marks(*m_texels, NestedTexels::steps[s + 1], is_rough[s + 1]);
    }
}

BentShares BentSolution::shares() const
{
    double beyond = 0.0;
    double area = 0.0;
    double solved = 0.0;
    double texels = 0.0;
    for (std::size_t i = 0; i < m_is_solved.size(); ++i) {
        if (!has_samples(i))
            continue;
        const auto of_texel = static_cast<double>(m_grid.bent_texel(i).area);
        area += of_texel;
        beyond += m_is_beyond[i] != 0 ? of_texel : 0.0;
        solved += m_is_solved[i];
        texels += 1.0;
    }
    return {beyond / area, solved / texels};
}

}  // namespace beamspread
