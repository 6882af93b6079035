// Light that a slab's far boundary returns without a single scattering. It leaves displaced, and is otherwise as sharp
// as it entered: of each texel's light squares, which are shared among the texels that they cover.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"
#include "solve/problem/beam_loops.h"
#include "solve/problem/directions.h"
#include "solve/problem/problem.h"

namespace beamspread {

namespace {

constexpr std::size_t table_steps = 1024;
constexpr std::size_t rows_per_strip = 64;

// Exits with less than this share of the incident power at any angle are left out.
constexpr double negligible_power = 1e-6;

// Angles and azimuths of one row.
struct DirectionRow {
    std::vector<float> cos_beta;
    std::vector<float> sin_beta;
    std::vector<float> half_tangent;  // tan(theta / 2)

    DirectionRow(const Problem& problem, const Channel& channel, std::size_t y)
        : cos_beta(problem.width), sin_beta(problem.width), half_tangent(problem.width)
    {
        if (problem.directions.field == nullptr) {
            const Vec3& d = problem.directions.uniform;
            std::fill(cos_beta.begin(), cos_beta.end(), static_cast<float>(std::cos(azimuth(d))));
            std::fill(sin_beta.begin(), sin_beta.end(), static_cast<float>(std::sin(azimuth(d))));
            const double tangent = std::tan(0.5 * incidence_deg(d) * radians_per_degree);
            std::fill(half_tangent.begin(), half_tangent.end(), static_cast<float>(tangent));
            return;
        }
        std::vector<float> irradiance(problem.width);
        for (std::size_t x = 0; x < problem.width; ++x)
            irradiance[x] = channel.irradiance(y, x);
        find_angles(problem.directions.field + 3 * y * problem.width, irradiance.data(), cos_beta.data(),
                    sin_beta.data(), half_tangent.data(), problem.width);
    }
};

// Distance and power of each exit over tan(theta / 2), which is smooth in both.
class ExitTable {
public:
    ExitTable(const Problem& problem, const Channel& channel)
    {
        if (!has_exits(problem, channel))
            return;
        const auto [first, last] = present(problem, channel);
        const double outside = 2.0 * (static_cast<double>(problem.width) * problem.pitch_x +
                                      static_cast<double>(problem.height) * problem.pitch_y);
        m_first = first;
        m_per_step = last > first ? static_cast<float>(table_steps) / (last - first) : 0.0f;
        for (std::size_t i = 0; i <= table_steps; ++i) {
            const double t = first + (last - first) * static_cast<double>(i) / static_cast<double>(table_steps);
            const auto exits = channel.library->ballistic(2.0 * std::atan(t) / radians_per_degree, Side::reflected);
            for (std::size_t k = 0; k < exits.size(); ++k) {
                if (k == m_exits.size() && exits[k].power >= negligible_power)
                    m_exits.emplace_back(table_steps + 1);
                if (k < m_exits.size())
                    m_exits[k][i] = {static_cast<float>(std::min(exits[k].u * channel.mean_free_path, outside)),
                                     static_cast<float>(exits[k].power)};
            }
        }
    }

    struct Exit {
        float distance = 0.0f;  // metres
        float power = 0.0f;  // per unit power incident
    };

    std::size_t count() const { return m_exits.size(); }

    Exit at(std::size_t k, float half_tangent) const
    {
        const float place = std::clamp((half_tangent - m_first) * m_per_step, 0.0f, static_cast<float>(table_steps));
        const auto step = std::min(static_cast<std::size_t>(place), table_steps - 1);
        const float part = place - static_cast<float>(step);
        const Exit& a = m_exits[k][step];
        const Exit& b = m_exits[k][step + 1];
        return {a.distance + part * (b.distance - a.distance), a.power + part * (b.power - a.power)};
    }

    float largest_distance() const
    {
        float largest = 0.0f;
        for (const auto& exits : m_exits)
            for (const Exit& exit : exits)
                largest = std::max(largest, exit.distance);
        return largest;
    }

private:
    // Any angle tells: where one has exits, all have.
    static bool has_exits(const Problem& problem, const Channel& channel)
    {
        for (std::size_t y = 0; y < problem.height; ++y)
            for (std::size_t x = 0; x < problem.width; ++x)
                if (channel.irradiance(y, x) > 0.0f)
                    return !channel.library->ballistic(incidence_deg(direction_at(problem, y, x)), Side::reflected)
                                .empty();
        return false;
    }

    // The least and the largest tan(theta / 2) of lit texels.
    static std::pair<float, float> present(const Problem& problem, const Channel& channel)
    {
        if (problem.directions.field == nullptr) {
            const float only = DirectionRow(problem, channel, 0).half_tangent.front();
            return {only, only};
        }
        std::pair<float, float> range{1.0f, 0.0f};
        for (std::size_t y = 0; y < problem.height; ++y) {
            const DirectionRow row(problem, channel, y);
            for (std::size_t x = 0; x < problem.width; ++x) {
                if (channel.irradiance(y, x) == 0.0f)
                    continue;
                range.first = std::min(range.first, row.half_tangent[x]);
                range.second = std::max(range.second, row.half_tangent[x]);
            }
        }
        return range;
    }

    float m_first = 0.0f;
    float m_per_step = 0.0f;
    std::vector<std::vector<Exit>> m_exits;
};

// Exitance that some rows of light cause, over the rows that it can reach.
struct Strip {
    std::size_t first_row = 0;
    std::vector<float> values;
};

class ChannelPass {
public:
    ChannelPass(const Problem& problem, const Channel& channel)
        : m_problem(problem), m_channel(channel), m_exits(problem, channel)
    {
    }

    void add(float* luminance, std::size_t stride) const
    {
        if (m_exits.count() == 0)
            return;
        const std::size_t strips = (m_problem.height + rows_per_strip - 1) / rows_per_strip;
        parallel_ordered<Strip>(
            strips, [&](std::size_t i) { return strip(i * rows_per_strip); },
            [&](std::size_t, const Strip& done) {
                float* out = luminance + done.first_row * m_problem.width * stride;
                for (std::size_t i = 0; i < done.values.size(); ++i)
                    out[i * stride] += done.values[i];
            });
    }

private:
    Strip strip(std::size_t first) const
    {
        const std::size_t last = std::min(m_problem.height, first + rows_per_strip);
        const double reach = static_cast<double>(m_exits.largest_distance()) / m_problem.pitch_y + 1.0;
        const auto rows = static_cast<std::size_t>(std::min(std::ceil(reach), static_cast<double>(m_problem.height)));
        Strip result{first - std::min(first, rows), {}};
        result.values.resize((std::min(m_problem.height, last + rows) - result.first_row) * m_problem.width);
        const auto per_x = static_cast<float>(1.0 / m_problem.pitch_x);
        const auto per_y = static_cast<float>(1.0 / m_problem.pitch_y);
        for (std::size_t y = first; y < last; ++y) {
            const DirectionRow row(m_problem, m_channel, y);
            for (std::size_t x = 0; x < m_problem.width; ++x) {
                const float irradiance = m_channel.irradiance(y, x);
                if (irradiance == 0.0f)
                    continue;
                for (std::size_t k = 0; k < m_exits.count(); ++k) {
                    const ExitTable::Exit exit = m_exits.at(k, row.half_tangent[x]);
                    share(result, static_cast<float>(x) + exit.distance * row.cos_beta[x] * per_x,
                          static_cast<float>(y) + exit.distance * row.sin_beta[x] * per_y,
                          irradiance * exit.power * static_cast<float>(inv_pi));
                }
            }
        }
        return result;
    }

    // A texel's worth of light whose corner is at (x, y), among the four texels that it covers.
    void share(Strip& to, float x, float y, float luminance) const
    {
        const float left = std::floor(x);
        const float below = std::floor(y);
        const auto column = static_cast<std::ptrdiff_t>(left);
        const auto line = static_cast<std::ptrdiff_t>(below);
        const std::array<float, 2> across = {luminance * (1.0f - (x - left)), luminance * (x - left)};
        const std::array<float, 2> up = {1.0f - (y - below), y - below};
        for (std::size_t j = 0; j < 2; ++j) {
            const std::size_t row = static_cast<std::size_t>(line) + j;
            if (row >= m_problem.height)  // a negative one wraps around to a large one
                continue;
            float* values = to.values.data() + (row - to.first_row) * m_problem.width;
            for (std::size_t i = 0; i < 2; ++i)
                if (const std::size_t place = static_cast<std::size_t>(column) + i; place < m_problem.width)
                    values[place] += across[i] * up[j];
        }
    }

    const Problem& m_problem;
    const Channel& m_channel;
    ExitTable m_exits;
};

}  // namespace

void add_unscattered(const std::vector<Problem>& lights, float* luminance)
{
    with_threads(lights.front().threads, [&] {
        for (const Problem& light : lights)
            for (std::size_t c = 0; c < light.channels.size(); ++c)
                ChannelPass(light, light.channels[c]).add(luminance + c, light.channels.size());
    });
}

}  // namespace beamspread
