// Python names of the rays in native/scene: gather_beams, gather_rays, ray_layers.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "base/view.h"
#include "python/vectors.h"
#include "scene/ray_gather.h"

namespace beamspread {

namespace {

// An array of vectors for the samples of a grid.
struct Field {
    Array<float> array;
    Vec3f* vectors;

    explicit Field(const ReceiverGrid& grid) : array(new_vectors(grid)), vectors(vectors_of(array).data)
    {
        std::fill_n(array.mutable_data(), array.size(), 0.0f);
    }
};

// Adds all rays of a texel up.
class Sum final : public RaySink {
public:
    explicit Sum(const ReceiverGrid& grid) : m_irradiance(grid), m_flow(grid) {}

    void add(const RayRun& run) override
    {
        Vec3f* const irradiance = m_irradiance.vectors + run.sample;
        Vec3f* const flow = m_flow.vectors + run.sample;
        for (std::size_t i = 0; i < run.count; ++i) {
            const Vec3f& light = run.irradiance[i];
            irradiance[i] += light;
            flow[i] += (light.x + light.y + light.z) / 3.0f * run.travel[i];
        }
    }

    py::object result() const { return py::make_tuple(m_irradiance.array, m_flow.array); }

private:
    Field m_irradiance, m_flow;
};

// Stores each ray of a texel.
class Layers final : public RaySink {
public:
    Layers(const ReceiverGrid& grid, std::size_t rays)
    {
        for (std::size_t i = 0; i < rays; ++i)
            m_layers.emplace_back(Field(grid), Field(grid));
    }

    void add(const RayRun& run) override
    {
        const auto& [irradiance, direction] = m_layers[run.ray];
        std::copy_n(run.irradiance, run.count, irradiance.vectors + run.sample);
        std::copy_n(run.travel, run.count, direction.vectors + run.sample);
    }

    py::object result() const
    {
        py::list layers;
        for (const auto& [irradiance, direction] : m_layers)
            layers.append(py::make_tuple(irradiance.array, direction.array));
        return layers;
    }

private:
    std::vector<std::pair<Field, Field>> m_layers;
};

// Stores the one ray of each texel; its irradiance is one number where light has no color.
class Beams final : public RaySink {
public:
    Beams(const ReceiverGrid& grid, bool is_colored, bool with_directions)
    {
        if (is_colored)
            m_colored.emplace(grid);
        else
            m_white = Array<float>({grid.height, grid.width});
        if (with_directions)
            m_directions.emplace(grid);
        m_values = m_white.mutable_data();
    }

    void add(const RayRun& run) override
    {
        if (m_colored)
            std::copy_n(run.irradiance, run.count, m_colored->vectors + run.sample);
        else
            std::transform(run.irradiance, run.irradiance + run.count, m_values + run.sample,
                           [](const Vec3f& light) { return light.x; });
        if (m_directions)
            std::copy_n(run.travel, run.count, m_directions->vectors + run.sample);
    }

    py::object irradiance() const { return m_colored ? m_colored->array : m_white; }
    py::object directions() const { return m_directions ? py::object(m_directions->array) : py::none(); }

private:
    Array<float> m_white;
    float* m_values;
    std::optional<Field> m_colored, m_directions;
};

void gather(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const RaySettings& settings,
            const py::object& callback, RaySink& sink)
{
    Progress progress(progress_callback(callback));
    const py::gil_scoped_release released;
    gather_rays(grid, light, occluders, settings, sink, progress);
}

py::object gather_sum(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, int rays,
                      std::uint32_t seed, int threads, const py::object& callback, double clearance, int even_rays,
                      int samples, bool find_shadows)
{
    Sum sum(grid);
    gather(grid, light, occluders,
           {.samples = samples,
            .rays = rays,
            .even_rays = even_rays,
            .seed = seed,
            .clearance = clearance,
            .threads = threads,
            .find_shadows = find_shadows},
           callback, sum);
    return sum.result();
}

py::object gather_layers(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, int rays,
                         std::uint32_t seed, int threads, const py::object& callback, double clearance)
{
    const int layer_count = light.is_delta() ? 1 : std::clamp(rays, 0, max_rays);  // others are rejected later
    Layers layers(grid, static_cast<std::size_t>(layer_count));
    gather(grid, light, occluders, {.rays = rays, .seed = seed, .clearance = clearance, .threads = threads}, callback,
           layers);
    return layers.result();
}

// Returns the directions of all texels, or the one direction of a light infinitely far away.
py::tuple gather_beams(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, int samples,
                       int threads, const py::object& callback, double clearance, bool find_shadows, bool directions)
{
    if (!light.is_delta())
        reject("light", "a light with a size", "one without");
    const bool is_far = light.source()->is_far;
    Beams beams(grid, occluders && occluders->is_colored(), directions && !is_far);
    gather(grid, light, occluders,
           {.samples = samples,
            .clearance = clearance,
            .threads = threads,
            .with_travel = directions && !is_far,
            .find_shadows = find_shadows},
           callback, beams);
    if (!is_far)
        return py::make_tuple(beams.irradiance(), beams.directions());
    const Vec3 travel = unblocked_direction(grid, light, grid.origin);
    return py::make_tuple(beams.irradiance(), Array<double>(3, &travel.x));
}

}  // namespace

void bind_rays(py::module_& m)
{
    m.def("gather_beams", &gather_beams, py::arg("grid"), py::arg("light"), py::arg("occluders") = py::none(),
          py::arg("samples") = 4, py::arg("threads") = 0, py::arg("progress") = py::none(), py::arg("clearance") = 0.0,
          py::arg("find_shadows") = true, py::arg("directions") = true,
          R"(Irradiance of a plane by a light without a size, and its direction.

Parameters
----------
grid : ReceiverGrid
light : Light
    Without a size.
occluders : Occluders, optional
    Meshes that cast shadows; None: nothing does.
samples : int
    samples x samples points in each texel, each with its own visibility; 1 to 64.
threads : int
    0: all. The result is the same, bit for bit, for any number.
progress : callable, optional
    progress(fraction) returns False to stop.
clearance : float
    Height above the plane where shadow rays start, metres, besides what rounding needs: the largest distance of the
    receiver's own faces to the plane, where they are among the occluders.
find_shadows : bool
    False: rays are traced from every texel, also where none can be blocked or one triangle blocks them all. The result
    is the same; for measurements.
directions : bool
    False: no array of directions is made.

Returns
-------
irradiance : ndarray, float32, shape (height, width), or (height, width, 3) past colored occluders
    W/m^2: cosine and visible part included, 0 if the light is behind the plane or in it. Row 0 is the lowest row.
direction : ndarray, float32, shape (height, width, 3), or float64, shape (3,) of a light infinitely far away
    Unit vectors of travel in the plane frame (x_axis, y_axis, normal), z < 0. Where no light arrives: that of the
    unblocked light, or (0, 0, -1) if the light is behind the plane or in it.

Raises
------
ValueError
    An argument is out of range; the message names it.
Cancelled
    `progress` returned False.
)");

    m.def("gather_rays", &gather_sum, py::arg("grid"), py::arg("light"), py::arg("occluders") = py::none(),
          py::arg("rays") = 16, py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("clearance") = 0.0, py::arg("even_rays") = 0, py::arg("samples") = 4, py::arg("find_shadows") = true,
          R"(Irradiance of a plane by a light, and its mean direction.

Parameters
----------
grid : ReceiverGrid
light : Light
occluders : Occluders, optional
    Meshes that cast shadows; None: nothing does.
rays : int
    Rays from each texel to a light with a size, 1 to 4096. Where nothing blocks the light, irradiance does not depend on
    the number, and has no noise.
seed : int
    Seed of these rays.
threads : int
    0: all. The result is the same, bit for bit, for any number.
progress : callable, optional
    progress(fraction) returns False to stop.
clearance : float
    Height above the plane where shadow rays start, metres, besides what rounding needs: the largest distance of the
    receiver's own faces to the plane, where they are among the occluders.
even_rays : int
    Rays of a first pass. They are enough in texels that, with their neighbors, see only light or only obstacles; `rays`
    are traced from all others. 0: no first pass.
samples : int
    For a light without a size, samples x samples points in each texel, each with its own visibility; 1 to 64.
find_shadows : bool
    False: for a light without a size, rays are traced from every texel, also where none can be blocked or one triangle
    blocks them all. The result is the same; for measurements.

Returns
-------
irradiance : ndarray, float32, shape (height, width, 3)
    W/m^2: cosine and visible part included. Row 0 is the lowest row.
flow : ndarray, float32, shape (height, width, 3)
    Sum over the rays of irradiance, the mean of its channels, times the unit vector of travel in the plane frame
    (x_axis, y_axis, normal), W/m^2.

Raises
------
ValueError
    An argument is out of range; the message names it.
Cancelled
    `progress` returned False.
)");

    m.def("ray_layers", &gather_layers, py::arg("grid"), py::arg("light"), py::arg("occluders") = py::none(),
          py::arg("rays") = 16, py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("clearance") = 0.0, R"(The rays of `gather_rays` one by one; arguments as there.

Returns
-------
list of (irradiance, direction)
    One ray of each texel: ndarrays, float32, shape (height, width, 3), W/m^2 and unit vectors of travel in the plane
    frame with z < 0.
)");
}

}  // namespace beamspread
