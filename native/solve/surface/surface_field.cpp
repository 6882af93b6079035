#include "solve/surface/surface_field.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <numeric>
#include <sstream>
#include <utility>

#include "base/constants.h"
#include "base/error.h"
#include "medium/medium.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Rays that pass all steps together. More: more cache.
constexpr std::size_t rays_at_once = 512;

// Groups of samples in one work item, which look for their sources together.
constexpr std::size_t groups_at_once = 8;

// Bounds on the error of a far cluster's light over the tolerance that are tried, from the largest on, each half of the
// one before. The first one is taken whose probed samples differ from those with a quarter of it by less than a fraction
// of the tolerance: errors of other samples are larger. Larger fraction: fewer pairs, larger errors.
constexpr double most_share = 64.0;
constexpr std::size_t shares = 20;
constexpr double probed_fraction = 0.2;

// Groups of which samples are probed: the brightest and others. More: errors closer to the tolerance, more time.
constexpr std::size_t bright_probes = 8;
constexpr std::size_t even_probes = 40;

// Size over distance of clusters with which the largest luminance is found.
constexpr float probing_size = 0.3f;

// Largest difference of the squared length of a unit vector from 1, and of the cosine of two vectors from 0.
constexpr float unit_tolerance = 2e-3f;

// Sizes of texels per octave for which kernels are made. More: fewer functions, less that surfaces share.
constexpr double texels_per_octave = 2.0;

// Fraction of a sample's luminance by pairs that bend more than the tables, from which it counts as beyond them.
constexpr float beyond_fraction = 0.5f;

void check_sample(const SurfaceSample& sample)
{
    const auto is_unit = [](const Vec3f& v) { return std::abs(glm::dot(v, v) - 1.0f) < unit_tolerance; };
    if (!(sample.area > 0.0f && std::isfinite(sample.area)))
        reject("area", static_cast<double>(sample.area), "above 0 m^2");
    if (!(std::isfinite(sample.position.x) && std::isfinite(sample.position.y) && std::isfinite(sample.position.z)))
        reject("position", "not finite", "metres");
    if (!is_unit(sample.normal) || !is_unit(sample.tangent) ||
        !(std::abs(glm::dot(sample.normal, sample.tangent)) < unit_tolerance))
        reject("normal", "with its tangent no frame", "unit vectors at right angles");
}

void check(const SurfaceProblem& problem)
{
    if (problem.samples.empty())
        reject("samples", "empty", "at least one");
    if (problem.channels.empty() || problem.channels.size() > 3)
        reject("channels", static_cast<double>(problem.channels.size()), "1 to 3");
    if (!(problem.tolerance > 0.0))
        reject("tolerance", problem.tolerance, "tolerance > 0");
    if (!(problem.max_angle_deg > 0.0 && problem.max_angle_deg <= 90.0))
        reject("max_angle_deg", problem.max_angle_deg, "above 0 and up to 90 degrees");
    for (const ChannelMedium& channel : problem.channels) {
        check_albedo(channel.albedo);
        if (!(channel.mean_free_path > 0.0 && std::isfinite(channel.mean_free_path)))
            reject("mean_free_path", channel.mean_free_path, "above 0 metres");
    }
    parallel_for(problem.samples.size() / rays_at_once + 1, [&](std::size_t item) {
        const std::size_t end = std::min(problem.samples.size(), (item + 1) * rays_at_once);
        for (std::size_t i = item * rays_at_once; i < end; ++i)
            check_sample(problem.samples[i]);
    });
}

void check_memory(std::size_t bytes, std::size_t limit)
{
    if (limit == 0 || bytes <= limit)
        return;
    const auto in_gigabytes = [](std::size_t of) { return std::ldexp(static_cast<double>(of), -30); };
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << "the light takes " << in_gigabytes(bytes) << " GB of memory, where "
         << in_gigabytes(limit) << " GB are left for it";
    throw MemoryLimit(text.str());
}

SampleAreas areas_of(const SurfaceProblem& problem)
{
    const std::span<const SurfaceSample> samples = problem.samples;
    const auto [least, most] = std::minmax_element(
        samples.begin(), samples.end(), [](const SurfaceSample& a, const SurfaceSample& b) { return a.area < b.area; });
    double sum = 0.0;
    for (const SurfaceSample& sample : samples)
        sum += static_cast<double>(sample.area);
    const float most_uneven = problem.uneven_sides.empty() ? 0.0f : std::ranges::max(problem.uneven_sides);
    return {least->area, most->area, static_cast<float>(sum / static_cast<double>(samples.size())), most_uneven};
}

// A length near to another one, of which kernels are made: surfaces of about the same texels share them.
double rounded(double length)
{
    return std::exp2(std::round(std::log2(length) * texels_per_octave) / texels_per_octave);
}

std::shared_ptr<SurfaceKernels> checked_kernels(const SurfaceProblem& problem)
{
    std::shared_ptr<SurfaceKernels> kernels;
    with_threads(problem.threads, [&] {
        check(problem);
        kernels = SurfaceKernels::recent({problem.channels, problem.max_angle_deg,
                                          rounded(std::sqrt(static_cast<double>(areas_of(problem).mean))),
                                          problem.is_colored, problem.tolerance});
    });
    return kernels;
}

// The brightest groups, and some evenly spread.
std::vector<SurfaceTree::Group> probed(std::vector<SurfaceTree::Group> groups)
{
    if (groups.size() <= bright_probes + even_probes)
        return groups;
    std::vector<SurfaceTree::Group> even;
    for (std::size_t i = 0; i < even_probes; ++i)
        even.push_back(groups[(2 * i + 1) * groups.size() / (2 * even_probes)]);
    std::stable_sort(groups.begin(), groups.end(),
                     [](const SurfaceTree::Group& a, const SurfaceTree::Group& b) { return a.weight > b.weight; });
    groups.resize(bright_probes);
    groups.insert(groups.end(), even.begin(), even.end());
    return groups;
}

PairTables tables_of(const SurfaceProblem& problem, SurfaceKernels& kernels)
{
    std::vector<PairTables> tables;
    with_threads(problem.threads, [&] { tables.emplace_back(kernels, areas_of(problem)); });
    return std::move(tables.front());
}

}  // namespace

SurfaceField::SurfaceField(const SurfaceProblem& problem, Progress& progress)
    : m_problem(problem),
      m_kernels(checked_kernels(problem)),
      m_basis(m_kernels->basis()),
      m_tables(tables_of(problem, *m_kernels)),
      m_tree(problem.samples)
{
    const std::size_t moments = problem.samples.size() + m_tree.nodes();
    check_memory(moments * moment_bytes(), problem.max_moment_bytes);
    progress.advance(0.0);
    m_moments.resize(moments * m_basis.lanes.moments());
}

void SurfaceField::set_color(const std::vector<double>& color)
{
    const double largest = *std::max_element(color.begin(), color.end());
    if (largest == 0.0)
        return;
    const std::lock_guard lock(m_color_lock);
    if (m_color.empty())
        for (const double part : color)
            m_color.push_back(part / largest);
    for (std::size_t c = 0; c < color.size(); ++c)
        if (std::abs(color[c] - m_color[c] * largest) > 1e-5 * largest)
            reject("color", "not proportional to that of earlier rays", "one color, or a field for colors");
}

void SurfaceField::add(std::span<const std::uint32_t> samples, const Vec3f* travel, const Vec3f* irradiance,
                       const std::vector<double>& color)
{
    if (m_basis.terms.terms.empty())  // the medium is black
        return;
    Scratch& scratch = m_scratch.local();
    const std::size_t channels = m_problem.channels.size();
    const std::size_t sets = m_basis.terms.sets.count();
    std::vector<float> colors(sets, 1.0f);
    if (!m_problem.is_colored) {
        set_color(color);
        colors[0] = static_cast<float>(*std::max_element(color.begin(), color.end()));
    } else {
        for (std::size_t set = 0; set < sets; ++set)
            colors[set] = static_cast<float>(color[m_basis.terms.sets.channel(set)]);
    }
    const std::vector<LightTerm>& terms = m_basis.terms.terms;
    for (std::size_t x = 0; x < samples.size(); x += rays_at_once) {
        const std::size_t rays = std::min(rays_at_once, samples.size() - x);
        BeamRow& beams = scratch.beams;
        for (auto* values : {&beams.irradiance, &beams.cos_beta, &beams.sin_beta, &beams.half_tangent})
            values->resize(rays);
        float largest = 0.0f;
        for (std::size_t i = 0; i < rays; ++i) {
            const Vec3f& power = irradiance[x + i];
            beams.irradiance[i] = power.x;
            for (std::size_t c = 1; c < channels; ++c)
                beams.irradiance[i] = std::max(beams.irradiance[i], power[static_cast<int>(c)]);
            largest = std::max(largest, beams.irradiance[i]);
        }
        if (largest == 0.0f)
            continue;
        find_angles(&travel[x].x, beams.irradiance.data(), beams.cos_beta.data(), beams.sin_beta.data(),
                    beams.half_tangent.data(), rays);
        if (m_problem.is_colored) {
            scratch.irradiance.resize(sets * rays);
            for (std::size_t set = 0; set < sets; ++set)
                for (std::size_t i = 0; i < rays; ++i)
                    scratch.irradiance[set * rays + i] =
                        irradiance[x + i][static_cast<int>(m_basis.terms.sets.channel(set))];
        }
        scratch.values.assign(terms.size() * rays, 0.0f);
        scratch.moments.add(
            m_basis.terms, beams, colors, 0, terms.size(),
            [&](std::size_t t) { return scratch.values.data() + t * rays; },
            m_problem.is_colored ? scratch.irradiance.data() : nullptr);
        for (std::size_t t = 0; t < terms.size(); ++t) {
            for (const std::size_t at : m_basis.places(t))
                for (std::size_t i = 0; i < rays; ++i)
                    m_moments[samples[x + i] * m_basis.lanes.moments() + at] += scratch.values[t * rays + i];
        }
    }
}

void SurfaceField::clear()
{
    std::fill(m_moments.begin(), m_moments.end(), 0.0f);
    m_color.clear();
}

void SurfaceField::solve(Progress& progress, float* luminance)
{
    std::fill_n(luminance, m_problem.samples.size() * m_problem.channels.size(), 0.0f);
    gather();
    solve({}, progress, luminance);
}

void SurfaceField::gather()
{
    m_is_beyond.assign(m_problem.samples.size(), 0);
    m_pairs = 0;
    m_brightest.fill(0.0f);
    if (m_basis.lanes.moments() == 0)
        return;
    with_threads(m_problem.threads, [&] {
        m_tree.gather(m_basis, m_tables, m_moments);
        find_opening();
    });
}

void SurfaceField::solve(std::span<const std::uint8_t> is_wanted, Progress& progress, float* luminance)
{
    if (m_basis.lanes.moments() == 0)
        return;
    const SurfaceTree::Targets targets = m_tree.targets(is_wanted);
    const std::size_t items = (targets.groups.size() + groups_at_once - 1) / groups_at_once;
    std::vector<std::size_t> pairs(items);
    with_threads(m_problem.threads, [&] {
        parallel_for(items, [&](std::size_t item) {
            SurfaceTree::Sources& sources = m_sources.local();
            const std::size_t begin = item * groups_at_once;
            const std::size_t end = std::min(targets.groups.size(), begin + groups_at_once);
            const auto groups = std::span(targets.groups).subspan(begin, end - begin);
            m_tree.find_candidates(groups, m_opening, m_tables.reach, sources);
            for (const SurfaceTree::Group& group : groups)
                pairs[item] += solve_group(
                    group, m_opening, sources,
                    [&](std::size_t sample, const Exitance& exitance) { store(sample, exitance, luminance); });
            progress.advance(1.0 / static_cast<double>(items));
        });
    });
    m_pairs += std::accumulate(pairs.begin(), pairs.end(), std::size_t{0});
}

// The error of a cluster's light is at most about its weight times its squared size times the kernel's second derivative.
// How errors of clusters add up depends on the surface and its light: some samples are solved with ever smaller bounds
// until the results change no more.
void SurfaceField::find_opening()
{
    const SurfaceTree::Targets targets = m_tree.targets({});
    const std::vector<SurfaceTree::Group> groups = probed(targets.groups);
    using Exitances = std::vector<std::array<float, max_results>>;
    const auto probe = [&](const SurfaceTree::Opening& opening) {
        std::vector<Exitances> found(groups.size());
        parallel_for(groups.size(), [&](std::size_t i) {
            SurfaceTree::Sources& sources = m_sources.local();
            m_tree.find_candidates(std::span(&groups[i], 1), opening, m_tables.reach, sources);
            solve_group(groups[i], opening, sources,
                        [&](std::size_t, const Exitance& exitance) { found[i].push_back(exitance.sums); });
        });
        return found;
    };
    // Largest difference of results, or largest result.
    const auto largest = [&](std::size_t r, const std::vector<Exitances>& found, const std::vector<Exitances>* other) {
        float most = 0.0f;
        for (std::size_t i = 0; i < groups.size(); ++i)
            for (std::size_t k = 0; k < found[i].size(); ++k)
                most = std::max(most, std::abs(found[i][k][r] - (other != nullptr ? (*other)[i][k][r] : 0.0f)));
        return most;
    };
    m_opening = {};
    const std::vector<Exitances> first = probe({probing_size, 0, {}});
    std::vector<double> bound(m_tables.point->light.rows);
    for (std::size_t r = 0; r < m_tables.lanes.results; ++r) {
        m_brightest[r] = largest(r, first, nullptr);
        const auto scale = static_cast<double>(m_tree.set_scales()[m_basis.terms.sets.results[r].set]);
        if (m_brightest[r] == 0.0f || scale == 0.0)
            continue;
        const std::vector<double> bends = m_tables.second_derivatives(r);
        for (std::size_t row = 0; row < bound.size(); ++row)
            bound[row] = std::max(bound[row], bends[row] / (scale * static_cast<double>(m_brightest[r])));
    }
    if (m_problem.is_direct)
        return;
    std::array<SurfaceTree::Opening, 3> openings;  // the last ones, in turn, and their results
    std::array<std::vector<Exitances>, 3> found;
    for (std::size_t i = 0; i < shares; ++i) {
        const double share = std::ldexp(most_share, -static_cast<int>(i));
        SurfaceTree::Opening& opening = openings[i % 3];
        opening = {0.0f, m_tables.point->light.first, {}};
        for (const double value : bound)
            opening.bound.push_back(static_cast<float>(value / (share * m_problem.tolerance)));
        found[i % 3] = probe(opening);
        bool is_enough = i >= 2;
        for (std::size_t r = 0; r < m_tables.lanes.results && i >= 2; ++r) {
            const auto change = static_cast<double>(largest(r, found[(i - 2) % 3], &found[i % 3]));
            is_enough =
                is_enough && change <= probed_fraction * m_problem.tolerance * static_cast<double>(m_brightest[r]);
        }
        if (is_enough) {
            m_opening = openings[(i - 2) % 3];
            return;
        }
    }
}

// Returns the number of pairs. `sources` has the candidates.
std::size_t SurfaceField::solve_group(const SurfaceTree::Group& group, const SurfaceTree::Opening& opening,
                                      SurfaceTree::Sources& sources,
                                      const std::function<void(std::size_t, const Exitance&)>& store_exitance) const
{
    m_tree.find(group, opening, m_tables.reach, sources);
    PairTargets targets;
    for (const std::uint32_t i : group.samples)
        targets.add(m_problem.samples[i].position, m_problem.samples[i].normal, i);
    std::array<float, PairTargets::most * max_results> sums{};
    std::array<float, PairTargets::most> beyond{};
    add_pairs(m_tables, targets, sources, m_moments.data(), m_basis.lanes.moments(), sums.data(), beyond.data());
    for (std::size_t k = 0; k < targets.count; ++k) {
        Exitance exitance{{}, beyond[k]};
        std::copy_n(sums.begin() + static_cast<std::ptrdiff_t>(k * max_results), max_results, exitance.sums.begin());
        if (m_tree.is_lit(targets.own[k]))
            add_self(targets.own[k], sources, exitance.sums);
        store_exitance(targets.own[k], exitance);
    }
    return targets.count * sources.count();
}

// Mean index of the disks of a sample's neighbors: where areas change, some neighbors have the next larger disk.
float SurfaceField::neighbor_disk(std::size_t sample) const
{
    const auto disk_of = [&](std::size_t i) { return static_cast<float>(m_tables.disk(m_problem.samples[i].area)); };
    if (m_problem.neighbors.empty())
        return disk_of(sample);
    float sum = 0.0f;
    for (const std::uint32_t neighbor : m_problem.neighbors[sample])
        sum += disk_of(neighbor);
    return 0.25f * sum;
}

LatticeShape SurfaceField::lattice(std::size_t sample) const
{
    if (m_problem.steps.empty())
        return {};
    const SurfaceSample& at = m_problem.samples[sample];
    const Vec3f binormal = glm::cross(at.normal, at.tangent);
    const auto in_frame = [&](const Vec3f& step) {
        return Vec2f(glm::dot(step, at.tangent), glm::dot(step, binormal));
    };
    return {in_frame(m_problem.steps[sample].x), in_frame(m_problem.steps[sample].y)};
}

bool SurfaceField::add_uneven(std::size_t sample, SurfaceTree::Sources& sources, std::array<float, 3>& sums) const
{
    const auto& [position, normal, tangent, area] = m_problem.samples[sample];
    const SampleSteps& steps = m_problem.steps[sample];
    const UnevenSample own{position, normal, tangent, steps.x, steps.y, m_problem.uneven_sides[sample]};
    if (!m_tree.find_near(position, near_sides * own.side, most_near, sources))
        return false;
    std::vector<NearSample> near;
    for (const PairSource* other : sources.near) {
        if (other->moments == sample)
            continue;
        const SampleSteps& of_other = m_problem.steps[other->moments];
        near.push_back({other->position, other->normal, of_other.x, of_other.y, m_problem.samples[other->moments].area,
                        m_tables.disks[other->disk]->radius});
    }
    m_tables.add_uneven_light(rings_around(own, m_tables.first_ring(), near),
                              m_moments.data() + sample * m_basis.lanes.moments(), sums.data());
    return true;
}

void SurfaceField::add_self(std::size_t sample, SurfaceTree::Sources& sources, std::array<float, 3>& sums) const
{
    const bool is_uneven = !m_problem.uneven_sides.empty() && m_problem.uneven_sides[sample] > 0.0f;
    if (is_uneven && add_uneven(sample, sources, sums))
        return;
    m_tables.add_self_light(m_problem.samples[sample].area, neighbor_disk(sample), lattice(sample),
                            m_moments.data() + sample * m_basis.lanes.moments(), sums.data());
}

void SurfaceField::store(std::size_t sample, const Exitance& exitance, float* luminance)
{
    const std::size_t channels = m_problem.channels.size();
    for (std::size_t r = 0; r < m_tables.lanes.results; ++r)
        for (const ChannelSets::Member& member : m_basis.terms.sets.results[r].members)
            luminance[sample * channels + member.channel] =
                std::max(0.0f, static_cast<float>(luminance_of(member, exitance.sums[r])));
    m_is_beyond[sample] = exitance.beyond > beyond_fraction * exitance.sums[0] ? 1 : 0;
}

double SurfaceField::luminance_of(const ChannelSets::Member& member, float exitance) const
{
    const double color = m_problem.is_colored ? 1.0 : m_color.empty() ? 0.0 : m_color[member.channel];
    return inv_pi * member.factor * color * static_cast<double>(exitance);
}

std::vector<float> SurfaceField::brightest() const
{
    std::vector<float> luminance(m_problem.channels.size());
    for (std::size_t r = 0; r < m_tables.lanes.results; ++r)
        for (const ChannelSets::Member& member : m_basis.terms.sets.results[r].members)
            luminance[member.channel] = static_cast<float>(luminance_of(member, m_brightest[r]));
    return luminance;
}

std::vector<SurfaceField::Weight> SurfaceField::weights_within(double radius, std::size_t result) const
{
    std::vector<Weight> weights;
    if (!(m_brightest[result] > 0.0f))
        return weights;
    const std::vector<ScaledProfile>& profiles = profiles_of(m_basis, result, flat_index(m_basis, result));
    for (std::size_t f = 0; f < m_basis.functions(); ++f) {
        const ScaledProfile& scaled = profiles[m_basis.rank[f]];
        // Other harmonics cancel around a sample.
        if (m_basis.harmonic[f] == 0)
            weights.push_back(
                {m_basis.lanes.place(result, f),
                 static_cast<float>(2.0 * pi * scaled.profile.cumulative(radius / scaled.mean_free_path)[0]) /
                     m_brightest[result]});
    }
    return weights;
}

float SurfaceField::exitance_within(std::span<const Weight> weights, std::size_t sample) const
{
    const float* moments = m_moments.data() + sample * m_basis.lanes.moments();
    float sum = 0.0f;
    for (const Weight& each : weights)
        sum += each.weight * moments[each.moment];
    return sum;
}

double SurfaceField::beyond_share() const
{
    double beyond = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < m_is_beyond.size(); ++i) {
        const auto area = static_cast<double>(m_problem.samples[i].area);
        all += area;
        beyond += m_is_beyond[i] != 0 ? area : 0.0;
    }
    return beyond / all;
}

}  // namespace beamspread
