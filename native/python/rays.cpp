// Python names of the rays in native/scene: gather_rays, ray_layers.
#include <algorithm>
#include <utility>
#include <vector>

#include "base/view.h"
#include "python/vectors.h"
#include "scene/ray_gather.h"

namespace beamspread {

namespace {

// Rows of vectors of one ray, or of the sum of all.
struct Field {
    Array<float> array;
    View2D<Vec3f> view;

    explicit Field(const ReceiverGrid& grid) : array(new_vectors(grid)), view(vectors_of(array))
    {
        std::fill_n(array.mutable_data(), array.size(), 0.0f);
    }
};

// Adds all rays of a texel up.
class Sum final : public RaySink {
public:
    explicit Sum(const ReceiverGrid& grid) : m_irradiance(grid), m_flow(grid) {}

    void add(const RayRow& row) override
    {
        Vec3f* const irradiance = &m_irradiance.view(row.y, row.x);
        Vec3f* const flow = &m_flow.view(row.y, row.x);
        for (std::size_t i = 0; i < row.width; ++i) {
            const Vec3f& light = row.irradiance[i];
            irradiance[i] += light;
            flow[i] += (light.x + light.y + light.z) / 3.0f * row.travel[i];
        }
    }

    py::object result() const { return py::make_tuple(m_irradiance.array, m_flow.array); }

private:
    Field m_irradiance, m_flow;
};

// Keeps each ray of a texel.
class Layers final : public RaySink {
public:
    Layers(const ReceiverGrid& grid, int rays)
    {
        for (int i = 0; i < rays && rays <= max_rays; ++i)  // more are refused later
            m_layers.emplace_back(Field(grid), Field(grid));
    }

    void add(const RayRow& row) override
    {
        const auto& [irradiance, direction] = m_layers[row.ray];
        std::copy_n(row.irradiance, row.width, &irradiance.view(row.y, row.x));
        std::copy_n(row.travel, row.width, &direction.view(row.y, row.x));
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

template <class Sink>
py::object gather(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders,
                  const RaySettings& settings, const py::object& callback, Sink& sink)
{
    Progress progress(progress_callback(callback));
    {
        const py::gil_scoped_release released;
        gather_rays(grid, light, occluders, settings, sink, progress);
    }
    return sink.result();
}

py::object gather_sum(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders, int rays,
                      std::uint32_t seed, int threads, const py::object& callback, double clearance, int even_rays)
{
    Sum sum(grid);
    return gather(grid, light, occluders, {rays, threads, clearance, seed, even_rays}, callback, sum);
}

py::object gather_layers(const ReceiverGrid& grid, const ExtendedLight& light, const Occluders* occluders, int rays,
                         std::uint32_t seed, int threads, const py::object& callback, double clearance)
{
    Layers layers(grid, rays);
    return gather(grid, light, occluders, {rays, threads, clearance, seed}, callback, layers);
}

}  // namespace

void bind_rays(py::module_& m)
{
    m.def("gather_rays", &gather_sum, py::arg("grid"), py::arg("light"), py::arg("occluders") = py::none(),
          py::arg("rays") = 16, py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("clearance") = 0.0, py::arg("even_rays") = 0,
          R"(Irradiance of a plane by a light of a size, and where it comes from on the whole.

Parameters
----------
grid : ReceiverGrid
light : ExtendedLight
occluders : Occluders, optional
    What casts shadows; None: nothing does.
rays : int
    From each texel, 1 to 4096. Where nothing is in the way the irradiance does not depend on it, and has no noise.
seed : int
    Another one gives other rays.
threads : int
    0: all. The result is the same, bit for bit, for any number.
progress : callable, optional
    progress(fraction) returns False to stop.
clearance : float
    How far off the plane shadow rays start, in metres, besides what rounding needs.
even_rays : int
    First, a look by so many rays: where they, and those of the texels around, all met light or all an obstacle, they are
    enough, and `rays` are traced from the other texels only. 0: from all.

Returns
-------
irradiance : ndarray, float32, shape (height, width, 3)
    W/m^2: cosine and visible part included. Row 0 is the lowest row.
flow : ndarray, float32, shape (height, width, 3)
    The sum over the rays of the irradiance, the mean of its channels, times unit vector of travel in the plane frame
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
          py::arg("clearance") = 0.0, R"(The rays of `gather_rays` one by one; arguments as there, but for `even_rays`.

Returns
-------
list of (irradiance, direction)
    One ray of each texel: ndarrays, float32, shape (height, width, 3), W/m^2 and unit vectors of travel in the plane
    frame with z < 0.
)");
}

}  // namespace beamspread
