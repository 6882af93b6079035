#include "scene/bounced_light.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>

#include "base/constants.h"
#include "base/error.h"
#include "base/sobol.h"
#include "base/threads.h"
#include "scene/bounce_guide.h"
#include "scene/checks.h"
#include "scene/node_noise.h"
#include "scene/path_wave.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

namespace {

// Paths that find points from which the choice among many lights is learned. More make it more even and take time.
constexpr std::size_t pilot_paths = 256;

// Paths of a lesson of the guide, and lessons, each of which uses the ones before. More find smaller windows.
constexpr std::size_t lesson_paths = 16384;
constexpr std::size_t lesson_waves = 64;
constexpr int lessons = 4;

// Part of the rays that arrive above which a light needs no guide.
constexpr float mostly_visible = 0.5f;

// Largest number of samples of a round: it bounds the work between two estimates of the noise.
constexpr std::size_t max_round = 64;

// Nodes of a mesh that bends whose paths are traced together.
constexpr std::size_t bent_columns = 64;

// Number of points in a block of the sequence of each node.
constexpr std::size_t block = 1024;

class Tracer {
public:
    Tracer(std::span<const NodeGrid> grids, std::span<const Stratum> strata, LightChoice& lights,
           const Occluders& surfaces, const BouncedSettings& settings)
        : m_grids(grids), m_strata(strata), m_lights(lights), m_surfaces(surfaces), m_settings(settings)
    {
        for (std::size_t half = 0; half < 2; ++half) {
            for (const NodeGrid& grid : grids)
                m_sums[half].emplace_back(grid.nodes() * strata.size(), Vec3f(0.0f));
            for (std::size_t k = 0; k < strata.size(); ++k) {
                std::uint64_t key = settings.seed * std::uint64_t{2} + half + (std::uint64_t{k} << 33);
                m_sobol[half].emplace_back(block, static_cast<std::uint32_t>(split_mix(key) >> 32));
            }
        }
        for (std::size_t n = 0; n < grids.size(); ++n)
            for (std::size_t row = 0; row < grids[n].rows; ++row)
                m_rows.push_back({n, row});
    }

    std::size_t samples() const { return m_samples; }
    std::size_t row_count() const { return m_rows.size(); }
    // Number of rays along paths so far.
    std::size_t rays() const { return m_rays; }

    // Learns which lights matter, and how their light comes in if something blocks most of it.
    void learn_lights()
    {
        Random random(m_settings.seed, pilot_stream, 0);
        PathWave wave(m_surfaces, m_lights, {.all = 1});
        for (std::size_t i = 0; i < pilot_paths; ++i)
            start_anywhere(i, wave, random);
        std::vector<ShadingPoint> points;
        wave.find_first(points);
        if (points.empty())
            return;
        m_lights.learn(points, random);
        std::vector<Vec3> positions;
        for (const ShadingPoint& point : points)
            positions.push_back(point.position);
        m_guide = BounceGuide(positions, m_lights.count());
        m_lights.set_guide(&m_guide);
        for (int lesson = 0; lesson < lessons; ++lesson) {
            parallel_ordered(lesson_waves, [&](std::size_t i) {
                auto records = std::make_shared<std::vector<GuideRecord>>(learn_by_paths(lesson, i));
                return [this, records] { m_guide.add(*records); };
            });
            if (is_open()) {
                m_lights.set_guide(nullptr);
                return;
            }
            m_guide.update();
        }
        m_lights.learn(points, random);
    }

    // Traces samples of one of the two estimates in all strata of all nodes.
    void trace(std::size_t half, std::size_t count, Progress& progress, double work)
    {
        parallel_for(m_rows.size(), [&](std::size_t i) {
            trace_row(half, m_rows[i], count);
            progress.advance(work / static_cast<double>(m_rows.size()));
        });
    }

    void count(std::size_t samples) { m_samples += samples; }

    // Mean radiance of a stratum at a node by one estimate.
    const std::vector<Vec3f>& sums(std::size_t half, std::size_t grid) const { return m_sums[half][grid]; }

private:
    struct Row {
        std::size_t grid;
        std::size_t row;
    };

    // Streams of random numbers: those of paths are the numbers of their samples.
    static constexpr std::uint64_t pilot_stream = ~std::uint64_t{0};

    // Starts a path from a random place in a random direction of a grid.
    void start_anywhere(std::size_t item, PathWave& wave, Random& random) const
    {
        const NodeGrid& grid = m_grids[item % m_grids.size()];
        Vec2 place(random.uniform(), 0.0);
        place.y = random.uniform();
        Vec2 at(random.uniform(), 0.0);
        at.y = random.uniform();
        const Vec2 nodes(static_cast<double>(grid.columns), static_cast<double>(grid.rows));
        if (grid.bent)
            start_bent(grid, glm::floor(place * nodes), glm::fract(place.x * nodes.x), cosine_hemisphere(at), 0, random,
                       wave);
        else
            wave.start(point(grid, place * grid.size), to_world(grid, cosine_hemisphere(at)), 0, random);
    }

    // Starts a path at a node of a mesh, at `place` among its texels.
    static void start_bent(const NodeGrid& grid, const Vec2& column_and_row, double place, const Vec3& local,
                           std::uint32_t slot, const Random& random, PathWave& wave)
    {
        const auto column = static_cast<std::size_t>(column_and_row.x);
        const auto row = static_cast<std::size_t>(column_and_row.y);
        const std::size_t node = std::min(row * grid.columns + column, grid.bent->size() - 1);
        const BentNodes::Start start = grid.bent->start(node, place);
        wave.start(start.origin, start.frame.to_world(local), slot, random);
    }

    std::vector<GuideRecord> learn_by_paths(int lesson, std::size_t item) const
    {
        std::vector<GuideRecord> records;
        std::vector<Vec3f> radiance(1, Vec3f(0.0f));
        PathWave wave(m_surfaces, m_lights, m_settings.limits);
        wave.record(&records);
        Random random(m_settings.seed, pilot_stream - 1 - static_cast<std::uint64_t>(lesson), item);
        for (std::size_t i = 0; i < lesson_paths / lesson_waves; ++i)
            start_anywhere(i, wave, random);
        wave.trace(radiance);
        return records;
    }

    bool is_open() const
    {
        for (std::uint32_t light = 0; light < m_lights.count(); ++light)
            if (m_guide.mean_visibility(light) < mostly_visible)
                return false;
        return true;
    }

    static Vec3 point(const NodeGrid& grid, const Vec2& at)
    {
        return grid.corner + grid.x_axis * at.x + grid.y_axis * at.y;
    }

    static Vec3 to_world(const NodeGrid& grid, const Vec3& local)
    {
        return grid.x_axis * local.x + grid.y_axis * local.y + grid.normal * local.z;
    }

    void trace_row(std::size_t half, const Row& at, std::size_t count)
    {
        const NodeGrid& grid = m_grids[at.grid];
        PathWave wave(m_surfaces, m_lights, m_settings.limits);
        std::vector<Vec3f> radiance(m_strata.size() * grid.columns, Vec3f(0.0f));
        std::vector<Vec2> front(count), back(count);
        const Vec2 pitch = grid.size / Vec2(grid.columns, grid.rows);
        // All samples of a node and stratum follow one low-discrepancy sequence; a wave holds one sample of each.
        std::vector<Vec2> places(count * radiance.size()), positions(places.size());
        for (std::size_t k = 0; k < m_strata.size(); ++k)
            for (std::size_t x = 0; x < grid.columns; ++x) {
                m_sobol[half][k].points(x, at.row, m_samples % block, count, front.data(), back.data());
                for (std::size_t i = 0; i < count; ++i) {
                    places[i * radiance.size() + k * grid.columns + x] = front[i];
                    positions[i * radiance.size() + k * grid.columns + x] = back[i];
                }
            }
        for (std::size_t i = 0; i < count; ++i) {
            for (std::size_t slot = 0; slot < radiance.size(); ++slot) {
                const Stratum& stratum = m_strata[slot / grid.columns];
                const Vec2& place = places[i * radiance.size() + slot];
                const Vec3 local = cosine_hemisphere(
                    {stratum.begin + place.x * stratum.extent, stratum.turn + place.y * stratum.part});
                const Vec2& position = positions[i * radiance.size() + slot];
                const std::uint64_t stream = (m_samples + i) * 2 + half;
                const std::uint64_t item = (std::uint64_t{at.grid} << 48) + at.row * radiance.size() + slot;
                const Random random(m_settings.seed, stream, item);
                const auto numbered = static_cast<std::uint32_t>(slot);
                const Vec2 node(slot % grid.columns, at.row);
                if (grid.bent)
                    start_bent(grid, node, position.x, local, numbered, random, wave);
                else
                    wave.start(point(grid, (node + position) * pitch), to_world(grid, local), numbered, random);
            }
            wave.trace(radiance);
        }
        m_rays += wave.rays();
        std::vector<Vec3f>& sums = m_sums[half][at.grid];
        for (std::size_t slot = 0; slot < radiance.size(); ++slot)
            sums[slot / grid.columns * grid.nodes() + at.row * grid.columns + slot % grid.columns] += radiance[slot];
    }

    std::span<const NodeGrid> m_grids;
    std::span<const Stratum> m_strata;
    LightChoice& m_lights;
    BounceGuide m_guide;
    const Occluders& m_surfaces;
    const BouncedSettings& m_settings;
    std::array<std::vector<GridSobol>, 2> m_sobol;               // [half][stratum]
    std::array<std::vector<std::vector<Vec3f>>, 2> m_sums;  // [half][grid][stratum][row][column]
    std::vector<Row> m_rows;
    std::size_t m_samples = 0;  // of each half
    std::atomic<std::size_t> m_rays{0};
};

// Irradiance of a grid's nodes, the mean of the channels, W/m^2.
std::vector<double> irradiance_of(const std::vector<Vec3f>& sums, std::span<const Stratum> strata, std::size_t nodes,
                                  std::size_t samples)
{
    std::vector<double> irradiance(nodes);
    for (std::size_t i = 0; i < sums.size(); ++i)
        irradiance[i % nodes] += strata[i / nodes].weight() * static_cast<double>(sums[i].x + sums[i].y + sums[i].z);
    for (double& value : irradiance)
        value *= pi / 3.0 / static_cast<double>(samples);
    return irradiance;
}

struct Estimate {
    double irradiance = 0.0;
    double error = 0.0;  // root mean square, W/m^2
};

// Errors of a grid's nodes as results average them.
std::vector<double> averaged(const NodeGrid& grid, const std::vector<double>& error, double spread)
{
    if (grid.bent)
        return grid.bent->smoothed(error, spread);
    const Vec2 pitch = grid.size / Vec2(grid.columns, grid.rows);
    return smoothed(error, grid.columns, spread / pitch.x, spread / pitch.y);
}

Estimate estimate(const Tracer& tracer, std::span<const NodeGrid> grids, std::span<const Stratum> strata, double spread)
{
    Estimate result;
    double nodes = 0.0;
    for (std::size_t n = 0; n < grids.size(); ++n) {
        const NodeGrid& grid = grids[n];
        const std::vector<double> first = irradiance_of(tracer.sums(0, n), strata, grid.nodes(), tracer.samples());
        const std::vector<double> second = irradiance_of(tracer.sums(1, n), strata, grid.nodes(), tracer.samples());
        std::vector<double> error(grid.different());
        for (std::size_t i = 0; i < error.size(); ++i) {
            result.irradiance += 0.5 * (first[i] + second[i]);
            // The variance of the mean of both is a quarter of that of their difference.
            error[i] = 0.5 * (first[i] - second[i]);
        }
        for (const double value : averaged(grid, error, spread))
            result.error += value * value;
        nodes += static_cast<double>(error.size());
    }
    result.irradiance /= nodes;
    result.error = std::sqrt(result.error / nodes);
    return result;
}

void check(std::span<const NodeGrid> grids, std::span<const Stratum> strata, const BouncedSettings& settings)
{
    for (const NodeGrid& grid : grids)
        grid.check();
    for (const Stratum& stratum : strata)
        if (!(stratum.begin >= 0.0 && stratum.extent > 0.0 && stratum.begin + stratum.extent <= 1.0 + 1e-9 &&
              stratum.part > 0.0 && stratum.part <= 1.0) ||
            !std::isfinite(stratum.turn))
            reject("strata", stratum.begin, "parts of the squared sine and of the turn, within 0 to 1");
    detail::check_length("direct", settings.direct, "a finite irradiance >= 0");
    detail::check_length("spread", settings.spread);
    if (!(settings.tolerance > 0.0))
        reject("tolerance", settings.tolerance, "above 0");
    for (const int limit : {settings.limits.all, settings.limits.diffuse, settings.limits.glossy})
        if (limit < 0)
            reject("max_bounces", limit, "0 or more");
    if (settings.max_samples < 2)
        reject("max_samples", settings.max_samples, "2 or more");
    if (!(settings.max_rays > 0.0))
        reject("max_rays", settings.max_rays, "above 0");
}

}  // namespace

NodeGrid NodeGrid::of(const BentNodes& bent)
{
    NodeGrid grid;
    grid.columns = std::min(bent_columns, bent.size());
    grid.rows = (bent.size() + grid.columns - 1) / grid.columns;
    grid.bent = &bent;
    return grid;
}

void NodeGrid::check() const
{
    if (bent)
        return;
    detail::check_finite("corner", corner);
    for (const Vec3& axis : {x_axis, y_axis, normal})
        if (!(std::abs(glm::length(axis) - 1.0) <= 1e-4))
            reject("axes", detail::to_text(axis), "unit vectors");
    if (!(size.x > 0.0 && size.y > 0.0) || !std::isfinite(size.x + size.y))
        reject("size", "(" + std::to_string(size.x) + ", " + std::to_string(size.y) + ")", "finite lengths > 0");
    if (columns < 1 || rows < 1 || columns > 4096 || rows > 4096)
        reject("nodes", std::to_string(columns) + " x " + std::to_string(rows), "1 to 4096 along a side");
}

BouncedLight trace_bounced_light(std::span<const NodeGrid> grids, std::span<const Stratum> strata,
                                 std::span<const SceneLight> lights, const Occluders* surfaces,
                                 const BouncedSettings& settings, Progress& progress)
{
    check(grids, strata, settings);
    BouncedLight result;
    for (const NodeGrid& grid : grids)
        result.radiance.emplace_back(grid.nodes() * strata.size(), Vec3f(0.0f));
    LightChoice choice(lights);
    if (!surfaces || !surfaces->is_reflecting() || choice.is_empty() || grids.empty() || !settings.limits.allow(0, 0)) {
        progress.finish();
        return result;
    }
    std::size_t paths_per_sample = 0;
    for (const NodeGrid& grid : grids)
        paths_per_sample += grid.nodes() * strata.size();
    with_threads(settings.threads, [&] {
        Tracer tracer(grids, strata, choice, *surfaces, settings);
        tracer.learn_lights();
        progress.set_total(1.0);
        const std::size_t most = static_cast<std::size_t>(settings.max_samples) / 2;
        double left = 1.0;  // of the progress
        std::size_t wanted = 2;
        while (tracer.samples() < wanted) {
            const std::size_t done = tracer.samples();
            const std::size_t count =
                std::min({std::max<std::size_t>(done, 1), wanted - done, max_round, block - done % block});
            // Until the noise is known, there may be as many samples as are allowed.
            const std::size_t planned = done < 2 ? std::max(most, wanted) : wanted;
            const double work = left * static_cast<double>(count) / static_cast<double>(planned - done);
            for (std::size_t half = 0; half < 2; ++half)
                tracer.trace(half, count, progress, 0.5 * work);
            left -= work;
            tracer.count(count);
            const Estimate found = estimate(tracer, grids, strata, settings.spread);
            const double all = settings.direct + found.irradiance;
            result.irradiance = found.irradiance;
            result.noise = all > 0.0 ? found.error / all : 0.0;
            // The variance falls in proportion to the number of samples.
            const double ratio = result.noise / settings.tolerance;
            const double needed = std::ceil(static_cast<double>(tracer.samples()) * ratio * ratio);
            const double affordable = static_cast<double>(tracer.samples()) * settings.max_rays /
                                      static_cast<double>(std::max<std::size_t>(tracer.rays(), 1));
            wanted = static_cast<std::size_t>(std::min({needed, affordable, static_cast<double>(most)}));
        }
        for (std::size_t n = 0; n < grids.size(); ++n)
            for (std::size_t i = 0; i < result.radiance[n].size(); ++i)
                result.radiance[n][i] =
                    (tracer.sums(0, n)[i] + tracer.sums(1, n)[i]) / static_cast<float>(2 * tracer.samples());
        result.paths = 2 * tracer.samples() * paths_per_sample;
    });
    progress.finish();
    return result;
}

}  // namespace beamspread
