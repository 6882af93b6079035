// Python name of the tracer in native/scene: gather_rays.
#include <algorithm>

#include "python/vectors.h"
#include "scene/ray_gather.h"

namespace beamspread {

namespace {

// An array of zero vectors for the samples of a grid.
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

    py::tuple result() const { return py::make_tuple(m_irradiance.array, m_flow.array); }

private:
    Field m_irradiance, m_flow;
};

py::tuple gather_sum(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, int rays,
                     std::uint32_t seed, int threads, const py::object& callback, double clearance, int even_rays,
                     int samples, bool find_shadows)
{
    Sum sum(grid);
    const RaySettings settings{.samples = samples,
                               .rays = rays,
                               .even_rays = even_rays,
                               .seed = seed,
                               .clearance = clearance,
                               .threads = threads,
                               .find_shadows = find_shadows};
    Progress progress(progress_callback(callback));
    {
        const py::gil_scoped_release released;
        gather_rays(grid, light, occluders, settings, sum, progress);
    }
    return sum.result();
}

}  // namespace

void bind_rays(py::module_& m)
{
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
}

}  // namespace beamspread
