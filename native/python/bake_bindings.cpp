// Python names of native/bake: Surface, FieldLight, LightField, bake_luminance, bake_arrival.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/bake.h"
#include "python/media.h"

namespace beamspread {

namespace {

// A surface and the arrays that it views.
struct HeldSurface {
    Surface surface;
    std::vector<py::object> arrays;
};

// A field and the sources of its media.
struct HeldField {
    Sources sources;
    std::unique_ptr<LightField> field;
};

// (light, color, occluders): a Light or a FieldLight, RGB, and Occluders or None.
using LightTuple = std::tuple<py::object, std::vector<double>, const Occluders*>;
using LightTuples = std::vector<LightTuple>;

const float* values_of(const std::string& name, const py::object& values, std::vector<std::size_t> shape,
                       std::vector<py::object>& arrays)
{
    if (values.is_none())
        return nullptr;
    const auto array = py::cast<py::array>(values);
    const bool fits = py::isinstance<Array<float>>(array) && static_cast<std::size_t>(array.ndim()) == shape.size() &&
                      std::equal(shape.begin(), shape.end(), array.shape());
    if (!fits)
        reject(name, shape_text(array), "contiguous float32, as large as the grid");
    arrays.push_back(array);
    return static_cast<const float*>(array.data());
}

HeldSurface surface_of(const ReceiverGrid& grid, const py::object& coverage, double clearance,
                       const py::object& color_in, const py::object& color_out, double mirrored)
{
    HeldSurface held;
    if (!(mirrored >= 0.0 && std::isfinite(mirrored)))
        reject("mirrored", mirrored, "0 or more metres");
    if (mirrored > 0.0 && grid.is_bent())
        reject("mirrored", mirrored, "0 on a mesh that bends");
    held.surface.mirrored = mirrored;
    held.surface.grid = grid;
    held.surface.clearance = clearance;
    held.surface.coverage = values_of("coverage", coverage, {grid.height, grid.width}, held.arrays);
    held.surface.color_in = values_of("color_in", color_in, {grid.height, grid.width, 3}, held.arrays);
    held.surface.color_out = values_of("color_out", color_out, {grid.height, grid.width, 3}, held.arrays);
    return held;
}

std::vector<Lobe> lobes_of(const py::object& directions, const Array<float>& solid_angles)
{
    const auto travel = py::cast<Array<float>>(directions);
    if (travel.ndim() != 2 || travel.shape(0) != solid_angles.size() || travel.shape(1) != 3)
        reject("directions", shape_text(travel), "(K, 3)");
    std::vector<Lobe> lobes;
    for (py::ssize_t i = 0; i < travel.shape(0); ++i)
        lobes.push_back({{travel.at(i, 0), travel.at(i, 1), travel.at(i, 2)}, solid_angles.at(i)});
    return lobes;
}

// Light at the nodes of a mesh that bends.
FieldLight cloud_light(const Array<float>& radiance, const Array<float>& solid_angles, const py::object& directions,
                       const py::array& positions, const py::array& normals, double spacing)
{
    const auto places = to_rows<Vec3, double>("positions", positions, "contiguous float64 (N, 3)");
    const auto upward = to_rows<Vec3, double>("normals", normals, "contiguous float64 (N, 3)");
    if (radiance.ndim() != 3 || side(radiance, 0) != side(solid_angles, 0) || side(radiance, 1) != places.size() ||
        radiance.shape(2) != 3)
        reject("radiance", shape_text(radiance), "(K, N, 3), with K solid angles and N positions");
    return {radiance.data(), NodeCloud({places.begin(), places.end()}, {upward.begin(), upward.end()}, spacing),
            lobes_of(directions, solid_angles)};
}

FieldLight field_light(const Array<float>& radiance, const Array<float>& solid_angles, const py::object& directions,
                       const py::object& position)
{
    if (radiance.ndim() != 4 || radiance.shape(3) != 3 || solid_angles.ndim() != 1 ||
        solid_angles.size() != radiance.shape(0))
        reject("radiance", shape_text(radiance), "(K, rows, columns, 3), with K solid angles");
    const std::size_t rows = side(radiance, 1);
    const std::size_t columns = side(radiance, 2);
    if (!position.is_none()) {
        if (radiance.shape(0) != 1)
            reject("radiance", shape_text(radiance), "one part for light from a position");
        return {radiance.data(), rows, columns, solid_angles.at(0), to_vec3("position", py::cast<Numbers>(position))};
    }
    return {radiance.data(), rows, columns, lobes_of(directions, solid_angles)};
}

SurfaceLight light_of(const LightTuple& tuple)
{
    const auto& [light, color, occluders] = tuple;
    if (color.size() != 3)
        reject("color", std::to_string(color.size()) + " channels", "3");
    SurfaceLight use{.color = color, .occluders = occluders};
    if (py::isinstance<FieldLight>(light))
        use.field = &py::cast<const FieldLight&>(light);
    else
        use.light = &py::cast<const Light&>(light);
    return use;
}

std::vector<SurfaceLight> lights_of(const LightTuples& tuples)
{
    std::vector<SurfaceLight> lights;
    std::ranges::transform(tuples, std::back_inserter(lights), light_of);
    return lights;
}

// The lights of each surface; none where a light does not arrive.
std::vector<ArrivingLights> arriving_lights(const std::vector<std::vector<std::optional<LightTuple>>>& tuples,
                                            std::size_t surfaces)
{
    if (tuples.size() != surfaces || surfaces == 0)
        reject("lights", "of " + std::to_string(tuples.size()) + " surfaces", "as many as 'surfaces', 1 or more");
    std::vector<ArrivingLights> lights;
    for (const auto& of_surface : tuples) {
        if (of_surface.size() != tuples.front().size())
            reject("lights", std::to_string(of_surface.size()) + " of a surface", "as many for each surface");
        ArrivingLights& arriving = lights.emplace_back();
        for (const std::optional<LightTuple>& tuple : of_surface)
            arriving.push_back(tuple ? std::optional(light_of(*tuple)) : std::nullopt);
    }
    return lights;
}

// Array of a vector of 3 for each texel of a grid.
Array<float> new_vectors(const ReceiverGrid& grid)
{
    return Array<float>({grid.height, grid.width, std::size_t{3}});
}

BakeOptions options_of(int samples, int rays, std::uint32_t seed, int threads)
{
    BakeOptions options;
    options.samples = samples;
    options.rays = rays;
    options.seed = seed;
    options.threads = threads;
    return options;
}

HeldField make_field(std::pair<std::size_t, std::size_t> shape, const Sources& ldf, const std::vector<double>& albedo,
                     const std::vector<double>& mean_free_path, std::array<double, 2> pitch, double max_angle,
                     double tolerance, bool is_colored, int threads, const std::string& side)
{
    const std::vector<ChannelMedium> media = media_of(ldf, albedo, mean_free_path, side);
    const Plane plane{shape.second, shape.first, pitch[0], pitch[1]};
    const py::gil_scoped_release release;
    return {ldf, any_light_field(plane, media, max_angle, tolerance, is_colored, threads)};
}

std::vector<Array<float>> luminance(const std::vector<const HeldSurface*>& held,
                                    const std::vector<std::vector<std::optional<LightTuple>>>& light_tuples,
                                    const Sources& ldf, const std::vector<double>& albedo,
                                    const std::vector<double>& mean_free_path, const std::string& solver,
                                    double tolerance, int samples, int rays, int min_rays, std::uint32_t seed,
                                    int threads, std::size_t max_stored_bytes, std::size_t memory_limit,
                                    const py::object& progress, const py::object& report_noise,
                                    const py::object& report_beyond, const std::string& side,
                                    const py::object& report_solved)
{
    const std::vector<ChannelMedium> media = media_of(ldf, albedo, mean_free_path, side);
    const std::vector<ArrivingLights> lights = arriving_lights(light_tuples, held.size());
    RayNoise noise;
    std::vector<BentShares> shares;
    const BakeOptions options{named_solver(solver), tolerance,    samples, rays,   min_rays, seed, threads,
                              max_stored_bytes,     memory_limit, &noise,  &shares};
    Progress report(progress_callback(progress));
    std::vector<Array<float>> results;
    std::vector<Surface> surfaces;
    std::vector<float*> data;
    for (const HeldSurface* surface : held) {
        surfaces.push_back(surface->surface);
        const ReceiverGrid& grid = surface->surface.grid;
        data.push_back(results.emplace_back(Array<float>({grid.height, grid.width, media.size()})).mutable_data());
    }
    {
        const py::gil_scoped_release release;
        bake_luminance(surfaces, lights, media, options, report, data);
    }
    if (!report_noise.is_none())
        report_noise(noise.irradiance, noise.variance);
    const auto report_shares = [&](const py::object& take, double BentShares::* share) {
        std::vector<double> values;
        for (const BentShares& of_surface : shares)
            values.push_back(of_surface.*share);
        if (!take.is_none())
            take(values);
    };
    report_shares(report_beyond, &BentShares::beyond);
    report_shares(report_solved, &BentShares::solved);
    return results;
}

Array<float> field_luminance(HeldField& held, const HeldSurface& surface, const LightTuples& light_tuples, int samples,
                             int rays, std::uint32_t seed, int threads, const py::object& progress)
{
    const Plane& plane = held.field->plane();
    if (surface.surface.grid.is_bent())
        reject("surface", "a mesh that bends", "a plane");
    if (surface.surface.grid.width != plane.width || surface.surface.grid.height != plane.height)
        reject("surface", "of another size", "the size of the field");
    const std::vector<SurfaceLight> lights = lights_of(light_tuples);
    const BakeOptions options = options_of(samples, rays, seed, threads);
    Progress report(progress_callback(progress));
    Array<float> result({plane.height, plane.width, held.field->channels()});
    float* data = result.mutable_data();
    const py::gil_scoped_release release;
    bake_luminance(surface.surface, lights, *held.field, options, report, data);
    return result;
}

py::tuple arrival(const HeldSurface& held, const LightTuples& light_tuples, int samples, int rays, std::uint32_t seed,
                  int threads, const py::object& progress, const py::object& report_noise, bool at_centers)
{
    const std::vector<SurfaceLight> lights = lights_of(light_tuples);
    RayNoise noise;
    BakeOptions options = options_of(samples, rays, seed, threads);
    options.at_centers = at_centers;
    options.noise = &noise;
    Progress report(progress_callback(progress));
    Array<float> irradiance = new_vectors(held.surface.grid);
    Array<float> flow = new_vectors(held.surface.grid);
    float* irradiance_data = irradiance.mutable_data();
    float* flow_data = flow.mutable_data();
    {
        const py::gil_scoped_release release;
        bake_arrival(held.surface, lights, options, report, irradiance_data, flow_data);
    }
    if (!report_noise.is_none())
        report_noise(noise.irradiance, noise.variance);
    return py::make_tuple(irradiance, flow);
}

}  // namespace

void bind_bake(py::module_& m)
{
    py::class_<HeldSurface>(m, "Surface", R"(A plane, or a mesh that bends, that light falls on and spreads in.

Parameters
----------
grid : ReceiverGrid
coverage : ndarray, float32, shape (H, W), optional
    Fraction of each texel inside the mesh; None: 1. No array is copied. Not used on a mesh that bends, where the areas of
    texels count.
clearance : float
    Largest distance of the surface's faces to the plane, metres.
color_in, color_out : ndarray, float32, shape (H, W, 3), optional
    Factors of light that enters and of light that leaves; None: 1.
mirrored : float
    Distance from the borders of the grid, metres, to which its mirror images return light; 0: light leaves there.
)")
        .def(py::init(&surface_of), py::arg("grid"), py::arg("coverage") = py::none(), py::arg("clearance") = 0.0,
             py::arg("color_in") = py::none(), py::arg("color_out") = py::none(), py::arg("mirrored") = 0.0);

    py::class_<FieldLight>(
        m, "FieldLight",
        R"(Light that was computed elsewhere, at nodes evenly spread over a plane; `on_mesh` makes it for meshes that bend.

Parameters
----------
radiance : ndarray, float32, shape (K, rows, columns, 3)
    Mean radiance of K parts of the hemisphere, W/(m^2 sr), 0 or more. Copied.
solid_angles : ndarray, float32, shape (K,)
    Irradiance over radiance of each part, sr.
directions : ndarray, float32, shape (K, 3)
    Unit vectors of travel in the plane's frame, z < 0.
position : 3 floats, optional
    Point that the light of one part comes from, in place of a direction: metres from the outer corner of texel (0, 0)
    in the plane's frame, z > 0.
)")
        .def(py::init(&field_light), py::arg("radiance"), py::arg("solid_angles"), py::arg("directions") = py::none(),
             py::arg("position") = py::none())
        .def_static(
            "on_mesh", &cloud_light, py::arg("radiance"), py::arg("solid_angles"), py::arg("directions"),
            py::arg("positions"), py::arg("normals"), py::arg("spacing"),
            R"(Light that was computed at nodes of a mesh that bends, such as `BentNodes`, for surfaces that bend.

Parameters
----------
radiance : ndarray, float32, shape (K, N, 3)
    Mean radiance of K parts of the hemisphere at each node, W/(m^2 sr), 0 or more. Copied.
solid_angles : ndarray, float32, shape (K,)
    Irradiance over radiance of each part, sr.
directions : ndarray, float32, shape (K, 3)
    Unit vectors of travel in the frame of each node (`BentNodes`), z < 0.
positions, normals : ndarray, float64, shape (N, 3), C-contiguous
    World positions, metres, and unit normals of the nodes.
spacing : float
    Distance of neighbors, about, metres: texels take the light of nodes of like normals within twice that distance.

Returns
-------
FieldLight

Raises
------
ValueError
    An argument is out of range; the message names it.
)");

    m.def("bake_luminance", &luminance, py::arg("surfaces"), py::arg("lights"), py::arg("ldf"), py::arg("albedo"),
          py::arg("mean_free_path"), py::arg("solver") = "fft", py::arg("tolerance") = 5e-3, py::arg("samples") = 4,
          py::arg("rays") = 256, py::arg("min_rays") = BakeOptions().min_rays, py::arg("seed") = 0,
          py::arg("threads") = 0, py::arg("max_stored_bytes") = BakeOptions().max_stored_bytes,
          py::arg("memory_limit") = 0, py::arg("progress") = py::none(), py::arg("report_noise") = py::none(),
          py::arg("report_beyond") = py::none(), py::arg("side") = "reflected", py::arg("report_solved") = py::none(),
          R"(Luminance of translucent surfaces: the engine behind `beamspread.core.bake`.

Parameters
----------
surfaces : sequence of Surface
    Light does not pass from one to another. A mesh that bends is solved by pairs of its texels, with the solver 'direct'
    by all of them one by one; it is 0 outside of the mesh.
lights : sequence of sequences of (light, color, occluders) or None
    For each surface and light: a Light or FieldLight of strength 1, its strength times color, RGB, and the Occluders
    that block it or None. None for a light that does not reach the surface.
ldf, albedo, mean_free_path, solver, tolerance
    As for `convolve`; one value per channel.
samples : int
    Lights without a size: samples x samples points in each texel, 1 to 64.
rays : int
    Rays from each texel to all lights of a size together, 1 to 4096.
min_rays : int
    Rays from each texel to each light of a size, at least.
seed : int
    Seed of these rays.
threads : int
    0: all. The result is the same, bit for bit, for any number.
max_stored_bytes : int
    Bytes of irradiance of lights of one direction that are stored until the solver 'fft' sees all of them. Beyond, light
    is added as moments, and terms are chosen for the brightest lights.
memory_limit : int
    Bytes of moments that the solver 'fft' may make of many or wide lights; 0: any.
progress : callable, optional
    progress(fraction) returns False to stop.
report_noise : callable, optional
    report_noise(irradiance, variance) takes the means over all surfaces of the irradiance, W/m^2, and of its variance
    in a texel, (W/m^2)^2. The latter comes from two halves of the rays to lights of a size.
report_beyond : callable, optional
    report_beyond(shares) takes the share of each surface's area that bends more than the LDFs cover; 0 on planes.
side : {"reflected", "transmitted"}
    Side of the luminance: where light enters, or the far side of a slab, at the same texels.
report_solved : callable, optional
    report_solved(shares) takes the share of each bent mesh's texels that are solved; others are interpolated, within
    the tolerance. 0 on planes.

Returns
-------
list of ndarray, float32, shape (H, W, channels)
    Of each surface: exitance / pi, W/(m^2 sr). Row 0 is the lowest row.

Raises
------
ValueError
    An argument is out of range; the message names it.
MemoryLimit
    The moments would take more memory.
Cancelled
    `progress` returned False.
)");

    py::class_<HeldField>(m, "LightField", R"(Terms and kernels of a medium on a plane, for any light.

Parameters
----------
shape : (int, int)
    Height and width of the plane, texels.
ldf, albedo, mean_free_path, pitch
    As for `convolve`; one value per channel.
max_angle : float
    Largest angle of incidence, degrees; light beyond counts as at that angle.
tolerance : float
    Largest relative error of kernels.
is_colored : bool
    True if lights may differ in color.
threads : int
    0: all.
side : {"reflected", "transmitted"}
    Side of the luminance: where light enters, or the far side of a slab, at the same texels.
)")
        .def(py::init(&make_field), py::arg("shape"), py::arg("ldf"), py::arg("albedo"), py::arg("mean_free_path"),
             py::arg("pitch"), py::arg("max_angle"), py::arg("tolerance"), py::arg("is_colored"),
             py::arg("threads") = 0, py::arg("side") = "reflected")
        .def("luminance", &field_luminance, py::arg("surface"), py::arg("lights"), py::arg("samples") = 4,
             py::arg("rays") = 256, py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
             "Luminance as of `bake_luminance`, by `rays` rays from each texel to each light of a size.")
        .def_property_readonly(
            "terms", [](const HeldField& held) { return held.field->terms(); },
            "int: number of transforms of light for each luminance.");

    m.def("bake_arrival", &arrival, py::arg("surface"), py::arg("lights"), py::arg("samples") = 4,
          py::arg("rays") = 256, py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("report_noise") = py::none(), py::arg("at_centers") = false,
          R"(Light on the whole of each texel, without a medium; arguments as for `bake_luminance`.

`rays` are those to each light of a size. With `at_centers` its falloff is that at the center of each texel also near
it: faster and less exact.

Returns
-------
irradiance : ndarray, float32, shape (H, W, 3)
    W/m^2 on the surface, cosine and visibility included.
flow : ndarray, float32, shape (H, W, 3)
    Sum over the light of its irradiance, the mean of the channels, times the unit vector of travel in the frame of the
    plane or of each texel.
)");
}

}  // namespace beamspread
