// Light that a slab's far boundary returns without a single scattering. It leaves displaced, and is otherwise as sharp
// as it entered: of each texel's light squares, which are shared among the texels that they cover.
#include "solve/unscattered.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/constants.h"
#include "base/threads.h"

namespace beamspread {

namespace {

constexpr std::size_t table_steps = 1024;
constexpr std::size_t rows_per_strip = 64;

// Exits with less than this share of the incident power at any angle are left out.
constexpr double negligible_power = 1e-6;

// Distance and power of each exit over tan(theta / 2), which is smooth in both.
class ExitTable {
public:
    ExitTable(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium)
    {
        const auto [first, last] = present(plane, light);
        if (first > last || medium.ldf->ballistic(angle_deg(first), Side::reflected).empty())
            return;  // any angle tells: where one has exits, all have
        const double outside = 2.0 * (static_cast<double>(plane.width) * plane.pitch_x +
                                      static_cast<double>(plane.height) * plane.pitch_y);
        m_first = first;
        m_per_step = last > first ? static_cast<float>(table_steps) / (last - first) : 0.0f;
        for (std::size_t i = 0; i <= table_steps; ++i) {
            const double t = first + (last - first) * static_cast<double>(i) / static_cast<double>(table_steps);
            const auto exits = medium.ldf->ballistic(angle_deg(t), Side::reflected);
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
    // The least and the largest tan(theta / 2) of lit texels.
    static std::pair<float, float> present(const Plane& plane, const PlaneLight& light)
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

    static double angle_deg(double half_tangent) { return 2.0 * std::atan(half_tangent) / radians_per_degree; }

    float m_first = 0.0f;
    float m_per_step = 0.0f;
    std::vector<std::vector<Exit>> m_exits;
};

// Exitance that some rows of light cause, over the rows that it can reach.
struct Strip {
    std::size_t first_row = 0;
    std::vector<float> values;
};

class LightPass {
public:
    LightPass(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium)
        : m_plane(plane), m_light(light), m_exits(plane, light, medium)
    {
    }

    void add(float* luminance, std::size_t stride, double color) const
    {
        if (m_exits.count() == 0 || color == 0.0)
            return;
        const auto factor = static_cast<float>(color);
        const std::size_t strips = (m_plane.height + rows_per_strip - 1) / rows_per_strip;
        parallel_ordered<Strip>(
            strips, [&](std::size_t i) { return strip(i * rows_per_strip); },
            [&](std::size_t, const Strip& done) {
                float* out = luminance + done.first_row * m_plane.width * stride;
                for (std::size_t i = 0; i < done.values.size(); ++i)
                    out[i * stride] += factor * done.values[i];
            });
    }

private:
    Strip strip(std::size_t first) const
    {
        const std::size_t last = std::min(m_plane.height, first + rows_per_strip);
        const double reach = static_cast<double>(m_exits.largest_distance()) / m_plane.pitch_y + 1.0;
        const auto rows = static_cast<std::size_t>(std::min(std::ceil(reach), static_cast<double>(m_plane.height)));
        Strip result{first - std::min(first, rows), {}};
        result.values.resize((std::min(m_plane.height, last + rows) - result.first_row) * m_plane.width);
        const auto per_x = static_cast<float>(1.0 / m_plane.pitch_x);
        const auto per_y = static_cast<float>(1.0 / m_plane.pitch_y);
        BeamRow row;
        for (std::size_t y = first; y < last; ++y) {
            if (!row.read(m_plane, m_light, {y, 0, m_plane.width}))
                continue;
            for (std::size_t x = 0; x < m_plane.width; ++x) {
                if (row.irradiance[x] == 0.0f)
                    continue;
                for (std::size_t k = 0; k < m_exits.count(); ++k) {
                    const ExitTable::Exit exit = m_exits.at(k, row.half_tangent[x]);
                    share(result, static_cast<float>(x) + exit.distance * row.cos_beta[x] * per_x,
                          static_cast<float>(y) + exit.distance * row.sin_beta[x] * per_y,
                          row.irradiance[x] * exit.power * static_cast<float>(inv_pi));
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
            if (row >= m_plane.height)  // a negative one wraps around to a large one
                continue;
            float* values = to.values.data() + (row - to.first_row) * m_plane.width;
            for (std::size_t i = 0; i < 2; ++i)
                if (const std::size_t place = static_cast<std::size_t>(column) + i; place < m_plane.width)
                    values[place] += across[i] * up[j];
        }
    }

    const Plane& m_plane;
    const PlaneLight& m_light;
    ExitTable m_exits;
};

}  // namespace

void add_unscattered(const Problem& problem, float* luminance)
{
    const std::size_t channels = problem.channels.size();
    for (const PlaneLight& light : problem.lights)
        for (std::size_t c = 0; c < channels; ++c)
            LightPass(problem.plane, light, problem.channels[c]).add(luminance + c, channels, light.color[c]);
}

}  // namespace beamspread
