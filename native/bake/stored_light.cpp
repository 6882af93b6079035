#include "bake/stored_light.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace beamspread {

namespace {

// Flow, W/m^2, below which single precision holds no direction.
constexpr double min_flow = 1e-30;

// Stores each ray of a texel.
class RayLayers final : public RaySink {
public:
    RayLayers(std::size_t samples, std::size_t rays, bool with_travel)
        : irradiance(rays, std::vector<float>(3 * samples)),
          travel(with_travel ? rays : 0, std::vector<float>(3 * samples))
    {
    }

    void add(const RayRun& run) override
    {
        copy(run.irradiance, run, irradiance[run.ray]);
        if (!travel.empty())
            copy(run.travel, run, travel[run.ray]);
    }

    std::vector<std::vector<float>> irradiance, travel;  // [ray][texel and channel, or x, y, z]

private:
    static void copy(const Vec3f* values, const RayRun& run, std::vector<float>& to)
    {
        static_assert(sizeof(Vec3f) == 3 * sizeof(float));
        std::copy_n(&values->x, 3 * run.count, to.data() + 3 * run.sample);
    }
};

double mean_of(const std::vector<double>& color)
{
    return std::accumulate(color.begin(), color.end(), 0.0) / static_cast<double>(color.size());
}

double mean_of(const PlaneLight& light)
{
    double sum = 0.0;
    for (std::size_t y = 0; y < light.irradiance.height; ++y)
        for (std::size_t x = 0; x < light.irradiance.width; ++x)
            sum += static_cast<double>(light.irradiance(y, x));
    const double texels = static_cast<double>(light.irradiance.height * light.irradiance.width);
    return sum * mean_of(light.color) / texels;
}

// The irradiance on some patches; 0 elsewhere.
std::vector<float> of_patches(const Canvas& canvas, const std::vector<std::size_t>& patches, const RaySum& sum)
{
    std::vector<float> part(sum.irradiance.size());
    for (const std::size_t i : patches) {
        const Patch& patch = canvas.patches[i];
        const std::size_t width = patch.surface->grid.width;
        for (std::size_t of_patch = 0; of_patch < patch.surface->samples(); of_patch += width) {
            const auto first = static_cast<std::ptrdiff_t>(canvas.sample(patch, of_patch) * sum.channels);
            std::copy_n(sum.irradiance.begin() + first, width * sum.channels, part.begin() + first);
        }
    }
    return part;
}

}  // namespace

void StoredLight::add(const Plane& plane, std::vector<float> irradiance, std::size_t channels,
                      const Directions& directions, const std::vector<double>& color)
{
    if (std::ranges::all_of(irradiance, [](float value) { return value == 0.0f; }))
        return;
    const auto stride = static_cast<std::ptrdiff_t>(channels);
    if (channels > 1)
        for (std::size_t i = 0; i < irradiance.size(); ++i)
            irradiance[i] *= static_cast<float>(color[i % channels]);
    const std::vector<float>& values = arrays.emplace_back(std::move(irradiance));
    std::vector<View2D<const float>> views;
    for (std::size_t c = 0; c < channels; ++c)
        views.push_back(
            {values.data() + c, plane.height, plane.width, static_cast<std::ptrdiff_t>(plane.width) * stride, stride});
    if (channels == 1) {
        lights.push_back({views[0], directions, color});
    } else {
        for (PlaneLight& light : lights_of_channels(views, directions))
            lights.push_back(std::move(light));
    }
    std::erase_if(lights, [](const PlaneLight& light) {
        return std::ranges::all_of(light.color, [](double factor) { return factor == 0.0; });
    });
}

void StoredLight::add_one_direction(const Canvas& canvas, const CanvasLight& light, const RaySettings& settings,
                                    Progress& progress)
{
    const bool is_colored = light.is_colored();
    if (const auto groups = light.parallel(); groups.size() > 1) {
        RaySum sum(canvas.samples(), is_colored ? 3 : 1, false);
        RaySettings without_travel = settings;
        without_travel.with_travel = false;
        light.gather(without_travel, sum, progress);
        for (const auto& [direction, patches] : groups)
            add(canvas.plane, of_patches(canvas, patches, sum), sum.channels, direction, light.color());
        return;
    }
    const std::optional<Directions> directions = light.directions();
    if (!directions || (is_colored && std::holds_alternative<FromPoint>(*directions))) {
        add_mean_direction(canvas, light, settings, progress);
        return;
    }
    RaySum sum(canvas.samples(), is_colored ? 3 : 1, false);
    RaySettings without_travel = settings;
    without_travel.with_travel = false;
    light.gather(without_travel, sum, progress);
    add(canvas.plane, std::move(sum.irradiance), sum.channels, *directions, light.color());
}

void StoredLight::add_rays(const Canvas& canvas, const CanvasLight& light, const RaySettings& settings,
                           Progress& progress)
{
    const FieldLight* const field = light.parts().front()->field;
    const std::size_t rays = field ? field->lobes() : static_cast<std::size_t>(settings.rays);
    // The directions of computed light are those of its parts, but for mirror images.
    const bool has_directions = field && !canvas.is_mirrored();
    RayLayers layers(canvas.samples(), rays, !has_directions);
    light.gather(settings, layers, progress);
    for (std::size_t i = 0; i < rays; ++i) {
        if (has_directions) {
            add(canvas.plane, std::move(layers.irradiance[i]), 3, field->directions(i), light.color());
        } else {
            const std::vector<float>& travel = arrays.emplace_back(std::move(layers.travel[i]));
            add(canvas.plane, std::move(layers.irradiance[i]), 3, PerTexel{travel.data()}, light.color());
        }
    }
}

void StoredLight::add_mean_direction(const Canvas& canvas, const CanvasLight& light, const RaySettings& settings,
                                     Progress& progress)
{
    RaySum sum(canvas.samples(), light.is_colored() ? 3 : 1, true);
    light.gather(settings, sum, progress);
    std::vector<float>& travel = arrays.emplace_back(3 * canvas.samples());
    for (std::size_t i = 0; i < canvas.samples(); ++i) {
        // In double precision: squares of 1e-22 have no digits in single.
        const Vec3 flow(sum.flow[i]);
        const double length = glm::length(flow);
        const Vec3 direction = length > min_flow ? flow / length : Vec3(0.0, 0.0, -1.0);
        for (int k = 0; k < 3; ++k)
            travel[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(direction[k]);
    }
    const Directions directions = PerTexel{travel.data()};
    add(canvas.plane, std::move(sum.irradiance), sum.channels, directions, light.color());
}

double StoredLight::mean() const
{
    double sum = 0.0;
    for (const PlaneLight& light : lights)
        sum += mean_of(light);
    return sum;
}

double StoredLight::mean_flow(const Plane& plane) const
{
    double sum = 0.0;
    for (std::size_t y = 0; y < plane.height; ++y)
        for (std::size_t x = 0; x < plane.width; ++x) {
            Vec3 flow(0.0);
            for (const PlaneLight& light : lights)
                flow += mean_of(light.color) * static_cast<double>(light.irradiance(y, x)) *
                        glm::normalize(travel_at(plane, light.directions, y, x));
            sum += glm::length(flow);
        }
    return sum / static_cast<double>(plane.texels());
}

}  // namespace beamspread
