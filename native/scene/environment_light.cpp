#include "scene/environment_light.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"
#include "scene/checks.h"
#include "scene/sky_irradiance.h"

namespace beamspread {

namespace {

// Smallest number of cells around the horizon, over which the cosine must hardly change. More cells lower the noise of
// rays, in proportion, and take more memory.
constexpr std::size_t min_cells = 256;

// Pixels of all images that are kept prepared for normals, some 10 bytes each. More: planes of several normals share
// them, more memory.
constexpr std::size_t max_prepared_pixels = std::size_t{1} << 23;

// Columns and rows of the parts of the sky by which irradiance is found for any normal, powers of two. More: narrow lights
// near the horizon are more exact.
constexpr std::size_t sky_columns = 256;
constexpr std::size_t sky_rows = 128;
static_assert(sky_columns <= min_cells && sky_rows <= min_cells / 2);

// Borders of the columns or rows of cells.
struct Lines {
    std::vector<double> angle, sine, cosine;

    Lines(std::size_t count, double first, double last)
    {
        for (std::size_t i = 0; i <= count; ++i) {
            angle.push_back(first + (last - first) * static_cast<double>(i) / static_cast<double>(count));
            sine.push_back(std::sin(angle.back()));
            cosine.push_back(std::cos(angle.back()));
        }
    }
};

// A discrete distribution by its cumulated weights, with a guide table that shortens each search (Chen and Asau 1974, "On
// generating random variates from an empirical distribution").
class Distribution {
public:
    Distribution() = default;

    // `cumulated` begins with 0 and must outlive the distribution.
    explicit Distribution(std::span<const double> cumulated)
        : m_cumulated(cumulated), m_guide(std::bit_ceil(cumulated.size() / cells_per_part + 1) + 1)
    {
        const std::size_t parts = m_guide.size() - 1;
        for (std::size_t k = 0; k <= parts; ++k)
            m_guide[k] = search(cumulated.back() * (static_cast<double>(k) / static_cast<double>(parts)), 0,
                                cumulated.size() - 2);
    }

    // The index that `at` in [0, 1) draws, and in `part` its fraction of the way through that index.
    std::size_t find(double at, double& part) const
    {
        const std::size_t k = part_of(at);
        const double wanted = at * m_cumulated.back();
        const std::size_t index = search(wanted, m_guide[k], m_guide[k + 1]);
        part = std::clamp((wanted - m_cumulated[index]) / (m_cumulated[index + 1] - m_cumulated[index]), 0.0, 1.0);
        return index;
    }

    // Prefetch the memory that `fetch` reads, and the memory that `find` reads.
    void fetch_guide(double at) const { __builtin_prefetch(&m_guide[part_of(at)]); }
    void fetch(double at) const { __builtin_prefetch(&m_cumulated[m_guide[part_of(at)] + 1]); }

    // Weight of an index, in the unit of `cumulated`.
    double weight(std::size_t index) const { return m_cumulated[index + 1] - m_cumulated[index]; }

private:
    static constexpr std::size_t cells_per_part = 4;

    // The number of parts is a power of two, so that their borders are exact.
    std::size_t part_of(double at) const
    {
        return static_cast<std::size_t>(at * static_cast<double>(m_guide.size() - 1));
    }

    // The index in [first, last] that a value lies in.
    std::uint32_t search(double wanted, std::size_t first, std::size_t last) const
    {
        const auto begin = m_cumulated.begin() + 1;
        const auto above = std::upper_bound(begin + static_cast<std::ptrdiff_t>(first),
                                            begin + static_cast<std::ptrdiff_t>(last), wanted);
        return static_cast<std::uint32_t>(above - begin);
    }

    std::span<const double> m_cumulated;
    std::vector<std::uint32_t> m_guide;
};

// An environment whose cells are drawn with probabilities proportional to their light on a plane, or, without a normal, to
// their light on surfaces that face them.
class FacingEnvironment final : public DistantLight {
public:
    FacingEnvironment(const EnvironmentMap& map, const std::optional<Vec3>& normal)
        : m_map(map),
          m_width(map.width * map.cells_x),
          m_height(map.height * map.cells_y),
          m_faces_all(!normal),
          m_is_even(
              std::ranges::all_of(map.radiance, [&](const Vec3f& value) { return value == map.radiance.front(); })),
          m_normal(glm::transpose(map.to_world) * normal.value_or(Vec3(0.0))),
          m_columns(m_width, pi, -pi),
          m_rows(m_height, -0.5 * pi, 0.5 * pi),
          m_cumulated(m_height * (m_width + 1)),
          m_cumulated_rows(m_height + 1),
          m_sagitta(2.0 * std::pow(std::sin(pi / static_cast<double>(m_width)), 2))
    {
        std::vector<Vec3> sums(m_height);
        parallel_for(m_height, [&](std::size_t y) { sums[y] = add_up(y); });
        for (std::size_t y = 0; y < m_height; ++y) {
            m_irradiance += sums[y];
            m_cumulated_rows[y + 1] = m_cumulated_rows[y] + m_cumulated[(y + 1) * (m_width + 1) - 1];
        }
        m_in_row.reserve(m_height);
        for (std::size_t y = 0; y < m_height; ++y)
            m_in_row.emplace_back(std::span(m_cumulated).subspan(y * (m_width + 1), m_width + 1));
        m_of_rows = Distribution(m_cumulated_rows);
        if (m_faces_all && !m_is_even) {
            std::vector<SkyPart> parts(sky_columns * sky_rows);
            parallel_for(sky_rows, [&](std::size_t y) {
                for (std::size_t x = 0; x < sky_columns; ++x)
                    parts[y * sky_columns + x] = sky_part(x, y);
            });
            m_sky = SkyIrradiance(std::move(parts), sky_columns);
        }
    }

    void sample(std::span<const Vec3> /*points*/, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override
    {
        if (!(m_cumulated_rows.back() > 0.0)) {
            std::fill_n(
                rays, square.size(),
                LightRay{.travel = -normal, .distance = std::numeric_limits<double>::infinity(), .flux = Vec3f(0.0f)});
            return;
        }
        for (std::size_t first = 0; first < square.size(); first += at_once)
            sample_some(square.subspan(first, std::min(at_once, square.size() - first)), rays + first);
    }

    Vec3 irradiance(const Vec3& /*point*/, const Vec3& normal) const override
    {
        if (!m_faces_all)
            return m_irradiance;
        return m_is_even ? pi * Vec3(m_map.radiance.front()) : m_sky.at(glm::transpose(m_map.to_world) * normal);
    }

    Seen seen(const Vec3& direction) const override
    {
        const auto [x, y] = cell_of(direction);
        const double total = m_cumulated_rows.back();
        return {m_map.of_cell(x, y), total > 0.0 ? m_in_row[y].weight(x) / total / solid_angle(y) : 0.0};
    }

private:
    // Rays that are drawn together: their memory lies far apart and is prefetched some steps ahead.
    static constexpr std::size_t at_once = 16;

    void sample_some(std::span<const Vec2> square, LightRay* rays) const
    {
        const double total = m_cumulated_rows.back();
        std::array<std::size_t, at_once> columns;
        std::array<std::size_t, at_once> rows;
        std::array<double, at_once> parts_x;
        std::array<double, at_once> parts_y;
        for (std::size_t i = 0; i < square.size(); ++i) {
            rows[i] = m_of_rows.find(square[i].y, parts_y[i]);
            m_in_row[rows[i]].fetch_guide(square[i].x);
        }
        for (std::size_t i = 0; i < square.size(); ++i)
            m_in_row[rows[i]].fetch(square[i].x);
        for (std::size_t i = 0; i < square.size(); ++i) {
            columns[i] = m_in_row[rows[i]].find(square[i].x, parts_x[i]);
            __builtin_prefetch(&m_map.of_cell(columns[i], rows[i]));
        }
        for (std::size_t i = 0; i < square.size(); ++i) {
            const std::size_t x = columns[i];
            const std::size_t y = rows[i];
            const double part_x = parts_x[i];
            const double part_y = parts_y[i];
            LightRay& ray = rays[i];
            ray.distance = std::numeric_limits<double>::infinity();
            const double probability = m_in_row[y].weight(x) / total;
            const double sine = std::lerp(m_rows.sine[y], m_rows.sine[y + 1], part_y);
            // The azimuth is drawn along the chord of the cell, then moved out to the arc: right to 3e-7 for cells of
            // at most 2 pi / min_cells.
            const double cosine = std::sqrt(std::max(1.0 - sine * sine, 0.0)) * arc_over_chord(part_x);
            const Vec3 direction(cosine * std::lerp(m_columns.cosine[x], m_columns.cosine[x + 1], part_x),
                                 cosine * std::lerp(m_columns.sine[x], m_columns.sine[x + 1], part_x), sine);
            ray.travel = -glm::normalize(m_map.to_world * direction);
            ray.flux = m_map.of_cell(x, y) * static_cast<float>(solid_angle(y) / probability);
        }
    }

    std::pair<std::size_t, std::size_t> cell_of(const Vec3& direction) const
    {
        const Vec3 local = glm::transpose(m_map.to_world) * direction;
        const auto of = [](double place, std::size_t count) {
            const double last = static_cast<double>(count) - 1.0;
            return static_cast<std::size_t>(std::clamp(place * static_cast<double>(count), 0.0, last));
        };
        return {of(0.5 - std::atan2(local.y, local.x) * 0.5 * inv_pi, m_width),
                of(0.5 + std::asin(std::clamp(local.z, -1.0, 1.0)) * inv_pi, m_height)};
    }

    // The chord of an arc of width w lies at the radius sqrt(1 - 4 t (1 - t) sin^2(w / 2)), here to first order.
    double arc_over_chord(double t) const { return 1.0 + m_sagitta * t * (1.0 - t); }

    double solid_angle(std::size_t y) const
    {
        return (m_rows.sine[y + 1] - m_rows.sine[y]) * 2.0 * pi / static_cast<double>(m_width);
    }

    // Cumulates the light of a row's cells, the mean of the channels; returns its sum.
    Vec3 add_up(std::size_t y)
    {
        Vec3 sum(0.0);
        for (std::size_t x = 0; x < m_width; ++x) {
            const Vec3 light = Vec3(m_map.of_cell(x, y)) * (m_faces_all ? solid_angle(y) : projected_solid_angle(x, y));
            sum += light;
            double* const cumulated = &m_cumulated[y * (m_width + 1) + x];
            cumulated[1] = cumulated[0] + (light.x + light.y + light.z) / 3.0;
        }
        return sum;
    }

    // The integral of cos(theta) over the part of a cell above the plane.
    double projected_solid_angle(std::size_t x, std::size_t y) const
    {
        const double e0 = m_rows.angle[y];
        const double e1 = m_rows.angle[y + 1];
        const double width = m_columns.angle[x] - m_columns.angle[x + 1];
        const double reach = 0.5 * std::hypot(width, e1 - e0);
        const double middle = cosine(0.5 * (m_columns.angle[x] + m_columns.angle[x + 1]), std::sin(0.5 * (e0 + e1)));
        if (middle <= -reach)
            return 0.0;
        if (middle >= reach)
            return glm::dot(directions(x, y), m_normal);
        // Steps along each side of a cell that the horizon cuts. More steps are slower; the error is below 4e-6.
        constexpr int steps = 8;
        double sum = 0.0;
        for (int j = 0; j < steps; ++j) {
            const double sine = std::lerp(m_rows.sine[y], m_rows.sine[y + 1], (j + 0.5) / steps);
            for (int i = 0; i < steps; ++i)
                sum += std::max(cosine(m_columns.angle[x] - width * (i + 0.5) / steps, sine), 0.0);
        }
        return sum / (steps * steps) * solid_angle(y);
    }

    // The integral of unit vectors over a cell.
    Vec3 directions(std::size_t x, std::size_t y) const
    {
        const double width = m_columns.angle[x] - m_columns.angle[x + 1];
        const double across = 0.5 * (m_rows.angle[y + 1] - m_rows.angle[y] + m_rows.sine[y + 1] * m_rows.cosine[y + 1] -
                                     m_rows.sine[y] * m_rows.cosine[y]);
        return {(m_columns.sine[x] - m_columns.sine[x + 1]) * across,
                (m_columns.cosine[x + 1] - m_columns.cosine[x]) * across,
                0.5 * width * (m_rows.sine[y + 1] * m_rows.sine[y + 1] - m_rows.sine[y] * m_rows.sine[y])};
    }

    // The light of the cells of a part of the sky, in the image's space.
    SkyPart sky_part(std::size_t column, std::size_t row) const
    {
        const std::size_t left = column * m_width / sky_columns;
        const std::size_t right = (column + 1) * m_width / sky_columns;
        const std::size_t bottom = row * m_height / sky_rows;
        const std::size_t top = (row + 1) * m_height / sky_rows;
        SkyPart part;
        for (std::size_t y = bottom; y < top; ++y)
            for (std::size_t x = left; x < right; ++x) {
                const Vec3 radiance(m_map.of_cell(x, y));
                const Vec3 flow = directions(x, y);
                const double angle = solid_angle(y);
                for (int c = 0; c < 3; ++c) {
                    part.light[static_cast<std::size_t>(c)] += radiance[c] * angle;
                    part.flow[static_cast<std::size_t>(c)] += radiance[c] * flow;
                }
            }
        const auto direction = [](double azimuth, double elevation) {
            return Vec3(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                        std::sin(elevation));
        };
        const std::array azimuths = {m_columns.angle[left], m_columns.angle[right]};
        const std::array elevations = {m_rows.angle[bottom], m_rows.angle[top]};
        part.center = direction(0.5 * (azimuths[0] + azimuths[1]), 0.5 * (elevations[0] + elevations[1]));
        for (const double azimuth : azimuths)
            for (const double elevation : elevations)
                part.reach = std::max(part.reach, glm::distance(part.center, direction(azimuth, elevation)));
        return part;
    }

    double cosine(double azimuth, double sine) const
    {
        const double across = std::sqrt(std::max(1.0 - sine * sine, 0.0));
        return glm::dot(m_normal, Vec3(across * std::cos(azimuth), across * std::sin(azimuth), sine));
    }

    const EnvironmentMap& m_map;
    std::size_t m_width, m_height;  // cells
    bool m_faces_all;
    bool m_is_even;  // true if the map has one radiance
    Vec3 m_normal;                  // in the image's space
    Lines m_columns, m_rows;
    std::vector<double> m_cumulated;  // along each row, one more than cells
    std::vector<double> m_cumulated_rows;
    std::vector<Distribution> m_in_row;
    Distribution m_of_rows;
    double m_sagitta;
    Vec3 m_irradiance{0.0};  // on the plane
    SkyIrradiance m_sky;     // for any normal; unused where the map is even
};

}  // namespace

EnvironmentLight::EnvironmentLight(const View2D<const Vec3f>& radiance, const Mat3& to_world)
{
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            if (!(std::abs(glm::dot(to_world[i], to_world[j]) - (i == j ? 1.0 : 0.0)) <= 1e-4))
                reject("to_world", detail::to_text(to_world[i]), "unit vectors at right angles");
        }
    }
    m_map = {.width = radiance.width,
             .height = radiance.height,
             .cells_x = (min_cells + radiance.width - 1) / radiance.width,
             .cells_y = (min_cells / 2 + radiance.height - 1) / radiance.height,
             .radiance = {},
             .to_world = to_world};
    m_map.radiance.reserve(radiance.width * radiance.height);
    for (std::size_t y = 0; y < radiance.height; ++y) {
        for (std::size_t x = 0; x < radiance.width; ++x) {
            const Vec3f value = radiance(y, x);
            if (!(value.x >= 0.0f && value.y >= 0.0f && value.z >= 0.0f) || !detail::is_finite(Vec3(value)))
                reject("radiance", detail::to_text(Vec3(value)), "finite values >= 0");
            m_is_colored |= value.x != value.y || value.y != value.z;
            m_map.radiance.push_back(value);
        }
    }
}

std::shared_ptr<const Light> EnvironmentLight::facing(const Vec3& normal, std::span<const Vec3> /*points*/) const
{
    return prepared(m_facing, normal);
}

std::shared_ptr<const Light> EnvironmentLight::facing_all() const
{
    return prepared(m_facing_all, std::nullopt);
}

std::shared_ptr<const Light> EnvironmentLight::prepared(std::vector<Prepared>& last,
                                                        const std::optional<Vec3>& normal) const
{
    {
        const std::scoped_lock lock(m_mutex);
        const auto known = std::ranges::find(last, normal, &Prepared::normal);
        if (known != last.end())
            return known->light;
    }
    // Without the lock, since its loop runs in parallel.
    auto light = std::make_shared<const FacingEnvironment>(m_map, normal);
    const std::scoped_lock lock(m_mutex);
    if (last.size() >= std::max<std::size_t>(max_prepared_pixels / m_map.radiance.size(), 1))
        last.erase(last.begin());
    last.push_back({normal, light});
    return light;
}

void EnvironmentLight::sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                              LightRay* rays) const
{
    facing(normal, {})->sample(points, normal, square, rays);
}

Vec3 EnvironmentLight::irradiance(const Vec3& point, const Vec3& normal) const
{
    return facing(normal, {})->irradiance(point, normal);
}

}  // namespace beamspread
