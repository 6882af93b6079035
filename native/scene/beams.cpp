#include "scene/beams.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <span>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "base/threads.h"
#include "scene/checks.h"
#include "scene/ray_start.h"
#include "scene/shadows.h"

namespace beamspread {

namespace {

// Points of a texel relative to its corner in the world, n x n: one in each cell of an n x n grid and one in each of n^2
// columns and n^2 rows, so that a shadow's border along the texels is resolved as finely as an oblique one (Chiu,
// Shirley, Wang 1994, "Multi-jittered sampling", without the jitter).
std::vector<Vec3> sub_texel_points(const ReceiverGrid& grid, int samples)
{
    std::vector<Vec3> points;
    for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i)
            points.push_back(grid.step((i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples));
    }
    return points;
}

// Points of the Gauss rule, two along each axis: from so many texels away on, they know the mean of a point lamp's light
// within a texel to 2e-6; from half as many 2.2e-5, from twice 9e-8.
constexpr double texels_to_smooth_lamp = 16.0;

std::vector<Vec3> gauss_points(const ReceiverGrid& grid)
{
    const double offset = 0.5 / std::numbers::sqrt3;
    std::vector<Vec3> points;
    for (const double y : {0.5 - offset, 0.5 + offset})
        for (const double x : {0.5 - offset, 0.5 + offset})
            points.push_back(grid.step(x, y));
    return points;
}

Vec3f to_single(const Vec3& amount)
{
    return Vec3f(amount);
}

float to_single(double amount)
{
    return static_cast<float>(amount);
}

double mean(const Vec3& amount)
{
    return (amount.x + amount.y + amount.z) / 3.0;
}

double mean(double amount)
{
    return amount;
}

// Of a ray's light, what its transmittance leaves: in all channels, or in one that stands for all.
template <class Amount>
Amount let_through(double irradiance, const Vec3f& transmittance)
{
    if constexpr (std::is_same_v<Amount, Vec3>)
        return irradiance * Vec3(transmittance);
    else
        return irradiance * static_cast<double>(transmittance.x);
}

// One light's beams on one grid; `Amount` of irradiance in W/m^2 is a number or, past coloured occluders, a Vec3.
template <class Amount>
class Gatherer {
public:
    Gatherer(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const BeamSettings& settings)
        : m_grid(grid),
          m_light(light),
          m_source(light.source()),
          m_occluders(occluders),
          m_points(sub_texel_points(grid, settings.samples)),
          m_smooth_points(gauss_points(grid)),
          m_smooth_from(texels_to_smooth_lamp * std::max(grid.pitch_x, grid.pitch_y)),
          m_position_rounding(std::numeric_limits<double>::epsilon() * grid.reach(Vec3(0.0))),
          m_start(ray_start(grid, occluders, settings.clearance)),
          m_shadows(grid, light.source(), occluders, m_start, settings.find_shadows),
          m_open_texel(gather_texel(0.0, 0.0, m_points, nullptr))
    {
    }

    std::size_t bands() const { return m_shadows.bands(); }

    // Returns the number of rows.
    template <class Texels>
    std::size_t gather_band(std::size_t band, const Texels& irradiance, const View2D<Vec3f>& direction)
    {
        std::vector<Shade>& shades = m_shades.local();
        m_shadows.shade_band(band, shades);
        const std::size_t begin = band * Shadows::rows_per_band;
        const std::size_t rows = shades.size() / m_grid.width;
        for (std::size_t row = 0; row < rows; ++row)
            gather_row(begin + row, &shades[row * m_grid.width], irradiance, direction);
        return rows;
    }

private:
    struct Texel {
        Amount irradiance{0.0};
        Vec3 flow{0.0};          // sum over the points of irradiance times direction of travel
        bool is_shaded = false;  // at any point
    };

    template <class Texels>
    void gather_row(std::size_t y, const Shade* shades, const Texels& irradiance, const View2D<Vec3f>& direction) const
    {
        for (std::size_t x = 0; x < m_grid.width; ++x) {
            const Texel found = texel(static_cast<double>(x), static_cast<double>(y), shades[x]);
            irradiance(y, x) = to_single(found.irradiance);
            if (direction.data)
                direction(y, x) = Vec3f(mean_direction(found.flow, static_cast<double>(x), static_cast<double>(y)));
        }
    }

    Texel texel(double x, double y, Shade shade) const
    {
        if (shade == Shade::full)
            return {};
        if (shade == Shade::unknown) {
            const Texel traced = gather_texel(x, y, m_points, m_occluders);
            return traced.is_shaded || !is_smooth(x, y) ? traced : gather_texel(x, y, m_smooth_points, nullptr);
        }
        if (m_source.is_far)
            return m_open_texel;
        return gather_texel(x, y, is_smooth(x, y) ? m_smooth_points : m_points, nullptr);
    }

    // Whether unblocked light is so even within a texel that few points tell its mean.
    bool is_smooth(double x, double y) const
    {
        const Vec3 away = m_source.position - m_grid.point(x, y);
        return m_source.is_smooth && m_points.size() > m_smooth_points.size() &&
               glm::dot(away, away) > m_smooth_from * m_smooth_from;
    }

    Texel gather_texel(double x, double y, std::span<const Vec3> points, const Occluders* occluders) const
    {
        Texel sum{};
        const Vec3 corner = m_grid.point(x, y);
        for (std::span<const Vec3> rest = points; !rest.empty();) {
            const std::span<const Vec3> packet = rest.first(std::min(rest.size(), Occluders::packet_size));
            sum = gather_points(corner, packet, occluders, sum);
            rest = rest.subspan(packet.size());
        }
        sum.irradiance /= static_cast<double>(points.size());
        return sum;
    }

    // Adds the light of at most as many points as make a packet of rays.
    Texel gather_points(const Vec3& corner, std::span<const Vec3> subs, const Occluders* occluders, Texel sum) const
    {
        std::array<Vec3, Occluders::packet_size> points;
        std::array<Arrival, Occluders::packet_size> arrivals;
        for (std::size_t i = 0; i < subs.size(); ++i)
            points[i] = corner + subs[i];
        m_light.arrive(std::span(points).first(subs.size()), arrivals.data());

        std::array<Vec3, Occluders::packet_size> travel;
        std::array<double, Occluders::packet_size> irradiance;
        std::array<ShadowRay, Occluders::packet_size> rays;
        std::size_t count = 0;
        for (std::size_t i = 0; i < subs.size(); ++i) {
            const Arrival& arrival = arrivals[i];
            const double cos_theta = -glm::dot(arrival.travel, m_grid.normal);
            if (!(cos_theta > min_cos_theta) || arrival.flux == 0.0 || arrival.distance <= m_position_rounding)
                continue;
            travel[count] = arrival.travel;
            irradiance[count] = arrival.flux * cos_theta;
            if (occluders)
                rays[count] = shadow_ray(m_grid, m_start, points[i], arrival.travel, arrival.distance);
            ++count;
        }
        sum.is_shaded |= count < subs.size();
        std::array<Vec3f, Occluders::packet_size> transmittance;
        transmittance.fill(Vec3f(1.0f));
        if (occluders)
            occluders->transmit(std::span(rays).first(count), transmittance.data());
        for (std::size_t i = 0; i < count; ++i) {
            sum.is_shaded |= transmittance[i] != Vec3f(1.0f);
            const Amount arriving = let_through<Amount>(irradiance[i], transmittance[i]);
            sum.irradiance += arriving;
            sum.flow += mean(arriving) * travel[i];
        }
        return sum;
    }

    // In the plane frame.
    Vec3 mean_direction(const Vec3& flow, double x, double y) const
    {
        const bool is_lit = glm::dot(flow, flow) > 0.0;
        return is_lit ? glm::normalize(m_grid.to_plane(flow))
                      : unblocked_direction(m_grid, m_light, m_grid.point(x + 0.5, y + 0.5));
    }

    const ReceiverGrid& m_grid;
    const Light& m_light;
    LightSource m_source;
    const Occluders* m_occluders;
    std::vector<Vec3> m_points;
    std::vector<Vec3> m_smooth_points;
    double m_smooth_from;  // metres from the lamp
    double m_position_rounding;  // a lamp within this of a point is in it: light there has neither direction nor bound
    RayStart m_start;
    Shadows m_shadows;
    PerThread<std::vector<Shade>> m_shades;
    Texel m_open_texel;  // texel (0, 0) with nothing in the way
};

}  // namespace

Vec3 unblocked_direction(const ReceiverGrid& grid, const Light& light, const Vec3& point)
{
    Arrival arrival;
    light.arrive({&point, 1}, &arrival);
    const Vec3 direction = glm::normalize(grid.to_plane(arrival.travel));
    return -direction.z > min_cos_theta ? direction : Vec3(0.0, 0.0, -1.0);
}

void compute_beams(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                   const BeamSettings& settings, const BeamArrays& beams, Progress& progress)
{
    grid.check();
    if (settings.samples < 1 || settings.samples > max_beam_samples)
        reject("samples", settings.samples, "1 to " + std::to_string(max_beam_samples));
    detail::check_length("clearance", settings.clearance);

    progress.set_total(static_cast<double>(grid.height));
    const auto gather = [&]<class Amount>(Amount, const auto& irradiance) {
        Gatherer<Amount> gatherer(grid, light, occluders, settings);
        const auto gather_band = [&](std::size_t band) {
            progress.advance(static_cast<double>(gatherer.gather_band(band, irradiance, beams.direction)));
        };
        with_threads(settings.threads, [&] { parallel_for(gatherer.bands(), gather_band); });
    };
    if (occluders && occluders->is_colored())
        gather(Vec3(), beams.colored);
    else
        gather(0.0, beams.irradiance);
    progress.finish();
}

}  // namespace beamspread
