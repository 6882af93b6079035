// Light that a slab's far boundary returns without scattering (transport/exact/exact_totals.h). It leaves displaced and
// as sharp as it entered: each texel's light becomes squares, whose power the texels below share.
#include "solve/problem/unscattered.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/constants.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Steps of the tables over tan(theta / 2). More: smaller errors, more cache.
constexpr std::size_t table_steps = 1024;
constexpr std::size_t rows_per_strip = 64;  // texel rows of one work item

// Fraction of the incident power below which an exit is ignored at all angles. Larger: larger errors.
constexpr double negligible_power = 1e-6;

// Bits of integer sums below the brightest light; 23 bits are left above it.
constexpr int fraction_bits = 40;

// Distance and power of each exit over tan(theta / 2), in which both are smooth.
class ExitTable {
public:
    ExitTable(const Plane& plane, const ChannelMedium& medium, std::pair<float, float> half_tangents)
    {
        const auto [first, last] = half_tangents;
        if (first > last || medium.ldf->ballistic(angle_deg(first), medium.side).empty())
            return;  // all angles have exits, or none
        const double outside = 2.0 * (static_cast<double>(plane.width) * plane.pitch_x +
                                      static_cast<double>(plane.height) * plane.pitch_y);
        m_first = first;
        m_per_step = last > first ? static_cast<float>(table_steps) / (last - first) : 0.0f;
        for (std::size_t i = 0; i <= table_steps; ++i) {
            const double t = first + (last - first) * static_cast<double>(i) / static_cast<double>(table_steps);
            const auto exits = medium.ldf->ballistic(angle_deg(t), medium.side);
            for (std::size_t k = 0; k < exits.size(); ++k) {
                if (k == m_exits.size() && exits[k].power >= negligible_power)
                    m_exits.emplace_back(table_steps + 1);
                if (k < m_exits.size())
                    m_exits[k][i] = {static_cast<float>(std::min(exits[k].u * medium.mean_free_path, outside)),
                                     static_cast<float>(exits[k].power)};
            }
        }
    }

    struct Exit {
        float distance = 0.0f;  // metres
        float power = 0.0f;  // per unit incident power
    };

    std::size_t count() const { return m_exits.size(); }

    Exit at(std::size_t k, float half_tangent) const
    {
        const float position = std::clamp((half_tangent - m_first) * m_per_step, 0.0f, static_cast<float>(table_steps));
        const auto step = std::min(static_cast<std::size_t>(position), table_steps - 1);
        const float part = position - static_cast<float>(step);
        const Exit& a = m_exits[k][step];
        const Exit& b = m_exits[k][step + 1];
        return {a.distance + part * (b.distance - a.distance), a.power + part * (b.power - a.power)};
    }

    float max_distance() const
    {
        float largest = 0.0f;
        for (const auto& exits : m_exits)
            for (const Exit& exit : exits)
                largest = std::max(largest, exit.distance);
        return largest;
    }

private:
    float m_first = 0.0f;
    float m_per_step = 0.0f;
    std::vector<std::vector<Exit>> m_exits;
};

// Smallest and largest tan(theta / 2) of lit texels.
std::pair<float, float> present(const Plane& plane, const PlaneLight& light)
{
    std::pair<float, float> range{1.0f, 0.0f};
    BeamRow row;
    for (std::size_t y = 0; y < plane.height; ++y) {
        if (!row.read(plane, light, {y, 0, plane.width}))
            continue;
        for (std::size_t x = 0; x < plane.width; ++x) {
            if (row.irradiance[x] == 0.0f)
                continue;
            range.first = std::min(range.first, row.half_tangent[x]);
            range.second = std::max(range.second, row.half_tangent[x]);
        }
    }
    return range;
}

// Calls add(texel, part) for each of the four texels on the plane that a texel with its corner at (x, y) covers.
template <class Add>
void share(const Plane& plane, float x, float y, const Add& add)
{
    const float left = std::floor(x);
    const float below = std::floor(y);
    const std::array<float, 2> across = {1.0f - (x - left), x - left};
    const std::array<float, 2> up = {1.0f - (y - below), y - below};
    for (std::size_t j = 0; j < 2; ++j)
        for (std::size_t i = 0; i < 2; ++i) {
            // Negative indices wrap around to large ones.
            const std::size_t column = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(left)) + i;
            const std::size_t row = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(below)) + j;
            if (column < plane.width && row < plane.height)
                add(row * plane.width + column, across[i] * up[j]);
        }
}

// Exitance of some rows of light, over the rows that it can reach.
struct Strip {
    std::size_t first_row = 0;
    std::vector<float> values;
};

// `entering`: [texel], every `stride`th value; null: 1.
Strip strip_from(std::size_t first, const Plane& plane, const PlaneLight& light, const ExitTable& exits,
                 const float* entering, std::size_t stride)
{
    const std::size_t last = std::min(plane.height, first + rows_per_strip);
    const double reach = static_cast<double>(exits.max_distance()) / plane.pitch_y + 1.0;
    const auto rows = static_cast<std::size_t>(std::min(std::ceil(reach), static_cast<double>(plane.height)));
    Strip result{first - std::min(first, rows), {}};
    result.values.resize((std::min(plane.height, last + rows) - result.first_row) * plane.width);
    const auto per_x = static_cast<float>(1.0 / plane.pitch_x);
    const auto per_y = static_cast<float>(1.0 / plane.pitch_y);
    BeamRow row;
    for (std::size_t y = first; y < last; ++y) {
        if (!row.read(plane, light, {y, 0, plane.width}))
            continue;
        for (std::size_t x = 0; x < plane.width && entering; ++x)
            row.irradiance[x] *= entering[(y * plane.width + x) * stride];
        for (std::size_t x = 0; x < plane.width; ++x) {
            if (row.irradiance[x] == 0.0f)
                continue;
            for (std::size_t k = 0; k < exits.count(); ++k) {
                const ExitTable::Exit exit = exits.at(k, row.half_tangent[x]);
                const float exitance = row.irradiance[x] * exit.power * static_cast<float>(inv_pi);
                share(plane, static_cast<float>(x) + exit.distance * row.cos_beta[x] * per_x,
                      static_cast<float>(y) + exit.distance * row.sin_beta[x] * per_y,
                      [&](std::size_t texel, float part) {
                          result.values[texel - result.first_row * plane.width] += exitance * part;
                      });
            }
        }
    }
    return result;
}

void add_unscattered(const Problem& problem, const PlaneLight& light, float* luminance)
{
    const Plane& plane = problem.plane;
    const std::size_t channels = problem.channels.size();
    for (std::size_t c = 0; c < channels; ++c) {
        const ExitTable exits(plane, problem.channels[c], present(plane, light));
        if (exits.count() == 0 || light.color[c] == 0.0)
            continue;
        const auto factor = static_cast<float>(light.color[c]);
        const float* const entering = problem.entering ? problem.entering + c : nullptr;
        parallel_ordered((plane.height + rows_per_strip - 1) / rows_per_strip, [&](std::size_t item) {
            return [&, done = strip_from(item * rows_per_strip, plane, light, exits, entering, channels)] {
                float* out = luminance + done.first_row * plane.width * channels + c;
                for (std::size_t i = 0; i < done.values.size(); ++i)
                    out[i * channels] += factor * done.values[i];
            };
        });
    }
}

}  // namespace

void add_unscattered(const Problem& problem, float* luminance)
{
    for (const PlaneLight& light : problem.lights)
        add_unscattered(problem, light, luminance);
}

struct UnscatteredRays::Exits {
    std::vector<ExitTable> tables;  // [channel]
};

UnscatteredRays::UnscatteredRays(const Problem& problem)
    : m_plane(problem.plane), m_entering(problem.entering), m_exits(std::make_unique<Exits>())
{
    // Smallest and largest angle of the survey; rays outside count as at these.
    std::pair<float, float> angles{1.0f, 0.0f};
    const auto include = [&](const Plane& plane, const PlaneLight& light) {
        const auto [first, last] = present(plane, light);
        angles = {std::min(angles.first, first), std::max(angles.second, last)};
    };
    for (const auto* lights : {&problem.lights, &problem.coming.examples})
        for (const PlaneLight& light : *lights)
            include(problem.plane, light);
    for (const SurveyedLight& surveyed : problem.coming.survey)
        include(surveyed.plane, surveyed.light);
    std::size_t count = 0;
    for (const ChannelMedium& medium : problem.channels)
        count += m_exits->tables.emplace_back(m_plane, medium, angles).count();
    double max_irradiance = 0.0;  // W/m^2, in any channel
    const auto add_brightest = [&](const PlaneLight& light) {
        const auto [y, x] = brightest(light.irradiance);
        max_irradiance += static_cast<double>(light.irradiance(y, x)) * *std::ranges::max_element(light.color);
    };
    for (const auto* lights : {&problem.lights, &problem.coming.examples})
        std::ranges::for_each(*lights, add_brightest);
    for (const SurveyedLight& surveyed : problem.coming.survey)
        add_brightest(surveyed.light);
    const std::size_t factors = m_entering ? m_plane.texels() * problem.channels.size() : 0;
    if (factors > 0)
        max_irradiance *= static_cast<double>(std::max(*std::max_element(m_entering, m_entering + factors), 1.0f));
    m_unit = std::ldexp(max_irradiance > 0.0 ? max_irradiance : 1.0, -fraction_bits);
    if (count > 0)
        m_sums.resize(m_plane.texels() * problem.channels.size());
}

UnscatteredRays::~UnscatteredRays() = default;

void UnscatteredRays::add(const RayRow& rays, const std::vector<double>& color)
{
    if (m_sums.empty())
        return;
    const std::size_t channels = color.size();
    for (std::size_t x = 0; x < rays.width; ++x) {
        const Vec3 travel(rays.travel[3 * x], rays.travel[3 * x + 1], rays.travel[3 * x + 2]);
        const double across = std::hypot(travel.x, travel.y);
        const double half_tangent = across / (glm::length(travel) - travel.z);
        const Vec2 step =
            across > 0.0 ? Vec2(travel.x / m_plane.pitch_x, travel.y / m_plane.pitch_y) / across : Vec2(0.0);
        for (std::size_t c = 0; c < channels; ++c) {
            const ExitTable& exits = m_exits->tables[c];
            const std::size_t texel_channel = (rays.y * m_plane.width + rays.x + x) * channels + c;
            const double entering = m_entering ? static_cast<double>(m_entering[texel_channel]) : 1.0;
            const double irradiance = entering * color[c] * static_cast<double>(rays.irradiance[x * channels + c]);
            for (std::size_t k = 0; k < exits.count() && irradiance > 0.0; ++k) {
                const auto [distance, power] = exits.at(k, static_cast<float>(half_tangent));
                const double exitance = irradiance * static_cast<double>(power) * inv_pi / m_unit;
                share(m_plane, static_cast<float>(rays.x + x) + distance * static_cast<float>(step.x),
                      static_cast<float>(rays.y) + distance * static_cast<float>(step.y),
                      [&](std::size_t texel, float part) {
                          std::atomic_ref(m_sums[texel * channels + c])
                              .fetch_add(std::llround(exitance * static_cast<double>(part)), std::memory_order_relaxed);
                      });
            }
        }
    }
}

void UnscatteredRays::clear()
{
    std::fill(m_sums.begin(), m_sums.end(), 0);
}

void UnscatteredRays::add_to(float* luminance) const
{
    for (std::size_t i = 0; i < m_sums.size(); ++i)
        luminance[i] += static_cast<float>(static_cast<double>(m_sums[i]) * m_unit);
}

}  // namespace beamspread
