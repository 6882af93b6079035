#include "solve/textured/textured.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/random.h"
#include "base/threads.h"
#include "solve/textured/path_products.h"
#include "solve/textured/shared_paths.h"
#include "solve/textured/smooth_ratio.h"
#include "solve/textured/sublattice.h"
#include "solve/textured/walk_shares.h"

namespace beamspread {

namespace {

// Walks for each texel come in units, which lights share. Larger: shares are finer, and more walks than wanted.
constexpr std::size_t unit = 32;

// Units of the first round, which shows the noise, and the most of a round relative to all before.
constexpr std::size_t first_units = 8;
constexpr std::size_t max_growth = 1;

// Wanted error of the sum of all texels, relative to that of a texel: if light has one direction, errors of texels of the
// same paths are alike everywhere. Smaller: sums are surer, and longer.
constexpr double total_part = 0.125;

// Farthest place from an exit, in texels, that fewer paths than this fraction pass; they count as at that distance.
constexpr double rarely = 1e-3;

// Paths survive a scattering with this power of the brightest albedo; their weights stay finite below 2. Larger: shorter
// paths, more noise.
constexpr double survival_power = 1.5;

// Largest probability to survive a scattering. Nearer to 1: longer paths in textures of little absorption.
constexpr double max_survival = 0.9999;

// Walks that show how far paths go, of all lights together; and sublattices along each axis. Fewer: the reach is less
// certain, and texels of the same paths, and of the same errors, are nearer to each other.
struct Fineness {
    std::size_t reach_walks;
    std::size_t side;
};
constexpr Fineness fine = {4096, 8};
// The same where texels have one unit of walks at most: to draw paths takes longer than to follow them.
constexpr Fineness coarse = {512, 4};

// Powers of the factor of light that leaves, of which the one with the smallest error is taken: 1 if light spreads less
// than the texture changes, 0 if it spreads so far that it leaves dark texels as bright as others. More: slower choice.
constexpr std::array<float, 5> leaving_powers = {1.0f, 0.75f, 0.5f, 0.25f, 0.0f};

// Rows by which they are chosen, in strips of this height. More: slower, and surer if parts of a texture differ.
constexpr std::size_t choice_rows = 256;
constexpr std::size_t strip_rows = 64;

// Stream of random numbers of the paths.
constexpr std::uint64_t path_stream = 0x7e87;

float largest(const View2D<const float>& values)
{
    float most = 0.0f;
    for (std::size_t y = 0; y < values.height; ++y)
        for (std::size_t x = 0; x < values.width; ++x)
            most = std::max(most, values(y, x));
    return most;
}

std::vector<View2D<const float>> irradiances_of(const TexturedProblem& problem)
{
    std::vector<View2D<const float>> irradiances;
    for (const TexturedLight& light : problem.lights)
        irradiances.push_back(light.irradiance);
    return irradiances;
}

// Walks of one angle from the normal, and the lights that they turn to.
struct WalkGroup {
    WalkPlan plan;
    std::vector<std::size_t> lights;
};

std::vector<WalkGroup> groups_of(const TexturedProblem& problem, double survival)
{
    std::vector<WalkGroup> groups;
    for (std::size_t i = 0; i < problem.lights.size(); ++i) {
        const double cos_theta = -problem.lights[i].travel.z;
        auto group = std::ranges::find(groups, cos_theta, [](const WalkGroup& each) { return each.plan.cos_theta; });
        if (group == groups.end())
            group =
                groups.insert(groups.end(), WalkGroup{{problem.medium, cos_theta, survival, problem.is_through}, {}});
        group->lights.push_back(i);
    }
    return groups;
}

std::vector<std::vector<std::size_t>> lights_of(const std::vector<WalkGroup>& groups)
{
    std::vector<std::vector<std::size_t>> lights;
    for (const WalkGroup& group : groups)
        lights.push_back(group.lights);
    return lights;
}

std::vector<Turn> turns_of(const TexturedProblem& problem)
{
    std::vector<Turn> turns;
    for (const TexturedLight& light : problem.lights)
        turns.emplace_back(light.travel, problem.texels_per_path);
    return turns;
}

// Distance that all but a few paths stay within, texels.
std::size_t reach_of(const std::vector<WalkGroup>& groups, const std::vector<Turn>& turns, std::size_t count,
                     std::uint64_t seed)
{
    std::vector<std::int32_t> farthest;
    for (std::size_t i = 0; i < groups.size(); ++i) {
        Random random(seed, path_stream, ~static_cast<std::uint64_t>(i));
        const std::vector<std::size_t>& lights = groups[i].lights;
        const Walks walks =
            drawn_walks(groups[i].plan, (count * lights.size() + turns.size() - 1) / turns.size(), random);
        for (std::size_t p = 0; p < walks.size(); ++p) {
            const Turn& turn = turns[lights[p % lights.size()]];
            std::int32_t most = 0;
            for (std::size_t k = walks.first[p]; k < walks.first[p + 1]; ++k) {
                const PathPlace place = turn(walks.places[k], walks.within[p]);
                most = std::max({most, std::abs(place.x), std::abs(place.y)});
            }
            farthest.push_back(most);
        }
    }
    if (farthest.empty())
        return 1;
    const auto at = static_cast<std::ptrdiff_t>((1.0 - rarely) * static_cast<double>(farthest.size() - 1));
    std::ranges::nth_element(farthest, farthest.begin() + at);
    return static_cast<std::size_t>(std::max(farthest[static_cast<std::size_t>(at)], 1));
}

class Textured {
public:
    Textured(const TexturedProblem& problem, const Fineness& fineness)
        : m_problem(problem),
          m_survival(std::clamp(std::pow(static_cast<double>(largest(problem.albedo)), survival_power),
                                problem.mean_albedo, max_survival)),
          m_groups(groups_of(problem, m_survival)),
          m_turns(turns_of(problem)),
          m_sublattices(problem.albedo.width, problem.albedo.height, fineness.side,
                        reach_of(m_groups, m_turns, fineness.reach_walks, problem.seed)),
          m_albedo(m_sublattices.dealt(problem.albedo, static_cast<float>(1.0 / m_survival), true)),
          m_entering(m_sublattices.dealt(problem.factor, 1.0f, false)),
          m_coverage(problem.coverage.data ? m_sublattices.dealt(problem.coverage, 1.0f, false)
                                           : AlignedVector<float>()),
          m_shares(irradiances_of(problem), lights_of(m_groups), m_sublattices)
    {
        for (const TexturedLight& light : problem.lights) {
            const auto entering = static_cast<float>(1.0 - fresnel(-light.travel.z, problem.medium.ior));
            m_light.push_back(m_sublattices.dealt(light.irradiance, entering, false));
            m_light_texels.push_back(m_sublattices.texels_of(light.irradiance));
        }
        for (std::size_t h = 0; h < 2; ++h) {
            m_sums.textured[h].resize(texels());
            m_sums.plain[h].resize(texels());
            m_totals[h].resize(m_sublattices.count());
        }
    }

    std::size_t texels() const { return m_problem.albedo.width * m_problem.albedo.height; }

    // Adds the paths of units of walks for each texel, half of them to each half.
    void add(std::size_t units, const std::function<void(double)>& advance)
    {
        ++m_rounds;
        const std::size_t walks = units * unit / 2;
        std::atomic<std::size_t> places{0};
        parallel_for(2 * m_sublattices.count(), [&](std::size_t task) {
            const std::size_t half = task / m_sublattices.count(), sublattice = task % m_sublattices.count();
            const std::size_t tiled = m_sublattices.tile_count() * tile_texels;
            AlignedVector<float> textured(tiled), plain(tiled);
            std::size_t taken = 0;
            for (std::size_t g = 0; g < m_groups.size(); ++g) {
                Random random(m_problem.seed + m_rounds, path_stream, task * m_groups.size() + g);
                const Walks drawn = drawn_walks(m_groups[g].plan, m_shares.drawn(g, walks), random);
                const std::vector<std::size_t>& lights = m_groups[g].lights;
                for (std::size_t i = 0; i < lights.size(); ++i)
                    taken += add_products(drawn, m_shares.start(g, i, walks), walks, sublattice, lights[i],
                                          textured.data(), plain.data());
            }
            places += taken;
            const std::size_t width = m_problem.albedo.width;
            Totals totals;
            m_sublattices.for_texels(sublattice, [&](std::size_t y, std::size_t x, std::size_t k) {
                const float factor = m_problem.factor(y, x);
                m_sums.textured[half][y * width + x] += textured[k] / factor;
                m_sums.plain[half][y * width + x] += plain[k];
                totals.textured += static_cast<double>(textured[k]);
                totals.plain += static_cast<double>(plain[k] * factor);
            });
            m_totals[half][sublattice].textured += totals.textured;
            m_totals[half][sublattice].plain += totals.plain;
            advance(1.0 / static_cast<double>(2 * m_sublattices.count()));
        });
        const std::size_t tiles = m_sublattices.count() * m_sublattices.tile_count();
        m_products += static_cast<double>(places) * static_cast<double>(texels()) / static_cast<double>(tiles);
    }

    // Most walks for each texel.
    double max_walks() const
    {
        const double more = std::min(m_shares.walks_at_once(), m_problem.max_more);
        return more * static_cast<double>(m_problem.max_walks);
    }

    // Scatterings of all texels in the walks so far.
    double products() const { return m_products; }

    // Estimated standard error of the ratio of all light, relative to it. Halves of the same texels are compared.
    double total_error() const
    {
        Totals all;
        for (const std::vector<Totals>& half : m_totals) {
            for (const Totals& totals : half) {
                all.textured += totals.textured;
                all.plain += totals.plain;
            }
        }
        if (!(all.textured > 0.0 && all.plain > 0.0))
            return 0.0;
        double variance = 0.0;
        for (std::size_t s = 0; s < m_sublattices.count(); ++s) {
            const double textured = m_totals[0][s].textured - m_totals[1][s].textured;
            const double plain = m_totals[0][s].plain - m_totals[1][s].plain;
            const double difference = textured / all.textured - plain / all.plain;
            variance += difference * difference;
        }
        return std::sqrt(variance);
    }

    // How the ratio is smoothed, and the estimated error.
    SmoothingChoice choice() const
    {
        return choose_smoothing(m_sums, m_problem.albedo.width,
                                [&](std::size_t y, float* values) { scale_row(y, m_power, values); });
    }

    // Frees the planes that paths need; no more can be added.
    void end_paths()
    {
        for (AlignedVector<float>* plane : {&m_albedo, &m_entering, &m_coverage})
            AlignedVector<float>().swap(*plane);
        m_light.clear();
    }

    // Takes the power of the factor of light that leaves by which a Gaussian leaves the smallest error. A sharp factor
    // times a smooth ratio would draw lines along borders where light hardly follows the factor. True if it is another.
    bool choose_power()
    {
        const std::vector<std::size_t> few = strips(m_problem.albedo.height);
        double least = std::numeric_limits<double>::infinity();
        float best = 1.0f;
        for (const float power : leaving_powers) {
            const double cost =
                cost_of_smoothing(sums_at(few, power), m_problem.albedo.width,
                                  [&](std::size_t y, float* values) { scale_row(few[y], power, values); });
            if (cost < least) {
                least = cost;
                best = power;
            }
        }
        if (best == m_power)
            return false;
        m_power = best;
        const std::size_t width = m_problem.albedo.width;
        parallel_for(m_problem.albedo.height, [&](std::size_t y) {
            for (std::size_t x = 0; x < width; ++x)
                for (std::vector<float>& half : m_sums.textured)
                    half[y * width + x] *= left(y, x, m_power);
        });
        return true;
    }

    // Writes the luminance; the sums are gone then.
    void write(const SmoothingChoice& choice, float* luminance, std::size_t stride)
    {
        const std::size_t width = m_problem.albedo.width;
        smooth_ratio(std::move(m_sums), width, choice, [&](std::size_t y, const float* ratio) {
            std::vector<float> scale(width);
            scale_row(y, m_power, scale.data());
            for (std::size_t x = 0; x < width; ++x)
                luminance[(y * width + x) * stride] = scale[x] * ratio[x];
        });
    }

private:
    // Light of all texels of a sublattice.
    struct Totals {
        double textured = 0.0;
        double plain = 0.0;
    };

    static std::vector<std::size_t> strips(std::size_t height)
    {
        const std::size_t step = std::max<std::size_t>((height + choice_rows - 1) / choice_rows, 1);
        std::vector<std::size_t> rows;
        for (std::size_t y = 0; y < height; ++y)
            if (y / strip_rows % step == 0)
                rows.push_back(y);
        return rows;
    }

    // The convention's factor of light that leaves, over a power of itself.
    float left(std::size_t y, std::size_t x, float power) const
    {
        return power == 1.0f ? 1.0f : std::pow(m_problem.factor(y, x), 1.0f - power);
    }

    // Row of the luminance by the convention over that factor, by which ratios are multiplied.
    void scale_row(std::size_t y, float power, float* values) const
    {
        for (std::size_t x = 0; x < m_problem.albedo.width; ++x)
            values[x] = m_problem.convention(y, x) / left(y, x, power);
    }

    // The sums at some rows, as they are smoothed with this power.
    PathSums sums_at(const std::vector<std::size_t>& rows, float power) const
    {
        const std::size_t width = m_problem.albedo.width;
        PathSums sums;
        for (std::size_t h = 0; h < 2; ++h) {
            sums.textured[h].resize(rows.size() * width);
            sums.plain[h].resize(rows.size() * width);
        }
        parallel_for(rows.size(), [&](std::size_t row) {
            for (std::size_t x = 0; x < width; ++x) {
                const std::size_t to = row * width + x, from = rows[row] * width + x;
                const float factor = left(rows[row], x, power);
                for (std::size_t h = 0; h < 2; ++h) {
                    sums.textured[h][to] = m_sums.textured[h][from] * factor;
                    sums.plain[h][to] = m_sums.plain[h][from];
                }
            }
        });
        return sums;
    }

    // Adds the paths of a light, as many of them as belong to each tile of all `walks`; the places that they pass. The light
    // has the drawn walks from `start` on, and then from the first on.
    std::size_t add_products(const Walks& drawn, std::size_t start, std::size_t walks, std::size_t sublattice,
                             std::size_t light, float* textured, float* plain) const
    {
        std::vector<std::ptrdiff_t> places, entries;
        std::vector<std::size_t> first{0}, walk;
        std::vector<float> weights;
        const Turn& turn = m_turns[light];
        const Offsets at_place = m_sublattices.offsets(sublattice, 1);
        const Offsets at_entry = m_sublattices.offsets(sublattice, m_light_texels[light]);
        const std::size_t most = m_shares.most(light, walks);
        const auto first_path =
            static_cast<std::size_t>(std::ranges::lower_bound(drawn.walk, start) - drawn.walk.begin());
        for (std::size_t i = 0; i < drawn.size(); ++i) {
            const std::size_t p = (first_path + i) % drawn.size();
            const std::size_t number = (drawn.walk[p] + drawn.count - start) % drawn.count;
            if (number >= most)
                break;
            const std::size_t begin = drawn.first[p], end = drawn.first[p + 1];
            const PathPlace entry = turn(drawn.places[begin], drawn.within[p]);
            if (!m_sublattices.is_within(entry))
                continue;  // light enters outside of the plane, or too far to matter
            entries.push_back(at_entry(entry));
            places.push_back(at_place(entry));
            for (std::size_t k = begin + 1; k < end; ++k)
                places.push_back(at_place(turn(drawn.places[k], drawn.within[p])));
            first.push_back(places.size());
            walk.push_back(number);
            weights.push_back(
                static_cast<float>(std::pow(m_problem.mean_albedo / m_survival, static_cast<double>(end - begin - 1))));
        }
        const PlacedPaths placed{entries, places, first, weights};
        std::size_t passed = 0;
        for (std::size_t down = 0; down < m_sublattices.tiles_down(); ++down) {
            for (std::size_t across = 0; across < m_sublattices.tiles_across(); ++across) {
                const std::size_t own = m_shares.walks(light, down, across, walks);
                const auto count = static_cast<std::size_t>(std::ranges::lower_bound(walk, own) - walk.begin());
                if (count == 0)
                    continue;
                // Fewer walks count more.
                const float scale = static_cast<float>(walks) / static_cast<float>(own);
                const std::size_t at = m_sublattices.tile(down, across);
                const std::size_t to = (down * m_sublattices.tiles_across() + across) * tile_texels;
                const float* const coverage = m_coverage.empty() ? nullptr : m_coverage.data() + at;
                const TilePlanes planes{m_light[light].data() + at, coverage, m_entering.data() + at,
                                        m_albedo.data() + at, static_cast<std::ptrdiff_t>(m_sublattices.stride())};
                add_path_products(placed, count, scale, planes, textured + to, plain + to);
                passed += first[count];
            }
        }
        return passed;
    }

    const TexturedProblem& m_problem;
    double m_survival;
    std::vector<WalkGroup> m_groups;
    std::vector<Turn> m_turns;  // [light]
    Sublattices m_sublattices;
    AlignedVector<float> m_albedo;
    AlignedVector<float> m_entering;  // the convention's factor of light that enters
    AlignedVector<float> m_coverage;  // empty: 1
    WalkShares m_shares;
    std::vector<AlignedVector<float>> m_light;
    std::vector<std::size_t> m_light_texels;  // of the plane, that show one of the light's, along each axis
    PathSums m_sums;
    float m_power = 1.0f;  // of the factor of light that leaves
    std::array<std::vector<Totals>, 2> m_totals;  // [half][sublattice]
    std::uint64_t m_rounds = 0;
    double m_products = 0.0;
};

void check(const TexturedProblem& problem)
{
    validate(problem.medium);
    const auto differs = [&](const View2D<const float>& view) {
        return view.height != problem.albedo.height || view.width != problem.albedo.width;
    };
    if (problem.albedo.height * problem.albedo.width == 0 || differs(problem.factor) || differs(problem.convention))
        reject("albedo", "of another size", "one value for each texel");
    if (problem.coverage.data != nullptr && differs(problem.coverage))
        reject("coverage", "of another size", "one value for each texel");
    for (const TexturedLight& light : problem.lights)
        if (light.irradiance.height * light.irradiance.width == 0)
            reject("irradiance", "empty", "one value or more");
    for (std::size_t y = 0; y < problem.albedo.height; ++y) {
        for (std::size_t x = 0; x < problem.albedo.width; ++x) {
            const float albedo = problem.albedo(y, x);
            if (!(albedo >= 0.0f && albedo < 1.0f))
                reject("albedo", std::to_string(albedo), "0 or more and below 1");
            if (!(problem.factor(y, x) > 0.0f))
                reject("factor", std::to_string(problem.factor(y, x)), "above 0");
        }
    }
}

}  // namespace

TexturedError solve_textured(const TexturedProblem& problem, Progress& progress, float* luminance, std::size_t stride)
{
    check(problem);
    progress.set_total(1.0);
    TexturedError result;
    with_threads(problem.threads, [&] {
        SmoothingChoice choice;
        Textured textured(problem, problem.max_walks > unit ? fine : coarse);
        std::size_t units = std::clamp<std::size_t>(problem.max_walks / unit, 1, first_units);
        double left = 1.0;
        while (true) {
            // How many rounds follow is not known: each takes half of what is left.
            const double share = left / 2.0;
            left -= share;
            textured.add(units, [&](double part) { progress.advance(share * part); });
            result.walks += units * unit;
            choice = textured.choice();
            result.error = choice.error;
            const auto walks = static_cast<double>(result.walks);
            const double excess = std::max(result.error, textured.total_error() / total_part) / problem.tolerance;
            const double wanted = walks * excess * excess;
            const double affordable =
                std::min(textured.max_walks(), problem.max_products / std::max(textured.products(), 1.0) * walks);
            const double more =
                (wanted < affordable ? std::ceil((wanted - walks) / unit) : std::floor((affordable - walks) / unit));
            if (more < 1.0)
                break;
            units = std::min(static_cast<std::size_t>(more), max_growth * (result.walks / unit));
        }
        // While more paths may follow the factor stays as it is: few paths do not show what another one blurs.
        textured.end_paths();
        if (result.error > problem.tolerance && textured.choose_power()) {
            choice = textured.choice();
            result.error = choice.error;
        }
        textured.write(choice, luminance, stride);
    });
    progress.finish();
    return result;
}

}  // namespace beamspread
