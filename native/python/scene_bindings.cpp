// Python names of receivers and tracers in native/scene: ReceiverGrid, coverage, gather_rays, bounced_light.
#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "bake/surface_light.h"
#include "python/casters.h"
#include "scene/bounced_light.h"
#include "scene/coverage.h"
#include "scene/ray_gather.h"

namespace beamspread {

namespace {

std::unique_ptr<ReceiverGrid> make_grid(const Numbers& origin, const Numbers& x_axis, const Numbers& y_axis,
                                        const Numbers& normal, double pitch_x, double pitch_y, py::ssize_t width,
                                        py::ssize_t height, std::uint32_t owner)
{
    // Negative sizes become huge ones, which the check rejects.
    const ReceiverGrid grid{.origin = to_vec3("origin", origin),
                            .x_axis = to_vec3("x_axis", x_axis),
                            .y_axis = to_vec3("y_axis", y_axis),
                            .normal = to_vec3("normal", normal),
                            .pitch_x = pitch_x,
                            .pitch_y = pitch_y,
                            .width = static_cast<std::size_t>(width),
                            .height = static_cast<std::size_t>(height),
                            .owner = owner};
    grid.check();
    return std::make_unique<ReceiverGrid>(grid);
}

// The values of each texel of a grid of `height` x `width`.
template <class Value, class Number>
std::span<const Value> texels_of(const std::string& name, const py::array& array, std::size_t height, std::size_t width,
                                 const std::string& allowed)
{
    const std::size_t size = sizeof(Value) / sizeof(Number);
    const bool fits = py::isinstance<Array<Number>>(array) && array.ndim() == (size > 1 ? 3 : 2) &&
                      side(array, 0) == height && side(array, 1) == width && (size == 1 || side(array, 2) == size);
    if (!fits)
        reject(name, shape_text(array), allowed);
    return {static_cast<const Value*>(array.data()), height * width};
}

std::unique_ptr<ReceiverGrid> make_bent_grid(const py::array& positions, const py::array& steps_x,
                                             const py::array& steps_y, const py::array& normals,
                                             const py::array& tangents, const py::array& areas, std::uint32_t owner)
{
    if (positions.ndim() != 3)
        reject("positions", shape_text(positions), "contiguous float64 (H, W, 3)");
    const std::size_t height = side(positions, 0);
    const std::size_t width = side(positions, 1);
    const auto vectors = [&](const char* name, const py::array& array) {
        return texels_of<Vec3f, float>(name, array, height, width, "contiguous float32 (H, W, 3) as 'positions'");
    };
    const auto places = texels_of<Vec3, double>("positions", positions, height, width, "contiguous float64 (H, W, 3)");
    const std::span<const Vec3f> across = vectors("steps_x", steps_x);
    const std::span<const Vec3f> up = vectors("steps_y", steps_y);
    const std::span<const Vec3f> out = vectors("normals", normals);
    const std::span<const Vec3f> along = vectors("tangents", tangents);
    const auto sizes = texels_of<float, float>("areas", areas, height, width, "contiguous float32 (H, W)");
    const py::gil_scoped_release released;
    std::vector<BentTexel> texels;
    texels.reserve(places.size());
    for (std::size_t i = 0; i < places.size(); ++i)
        texels.push_back({.position = places[i],
                          .step_x = across[i],
                          .step_y = up[i],
                          .normal = out[i],
                          .tangent = along[i],
                          .area = sizes[i]});
    return std::make_unique<ReceiverGrid>(ReceiverGrid::bent(std::move(texels), width, height, owner));
}

Array<float> coverage(const py::array& corners, const py::array& corner_counts, py::ssize_t width, py::ssize_t height,
                      int threads, py::ssize_t row_step, bool is_cut)
{
    const auto points = to_rows<Vec2, double>("corners", corners, "contiguous float64 (N, 2)");
    if (!py::isinstance<Array<std::uint32_t>>(corner_counts) || corner_counts.ndim() != 1)
        reject("corner_counts", shape_text(corner_counts), "contiguous uint32 (P,)");
    if (width < 1 || height < 1)
        reject(width < 1 ? "width" : "height", static_cast<double>(std::min(width, height)), "1 or more texels");
    if (row_step < 1)
        reject("row_step", static_cast<double>(row_step), "1 or more texels");
    const CoverageOptions options{.row_step = static_cast<std::size_t>(row_step), .is_cut = is_cut, .threads = threads};
    const std::span counts(static_cast<const std::uint32_t*>(corner_counts.data()), side(corner_counts, 0));
    Array<float> covered({height, width});
    const View2D<float> texels{covered.mutable_data(), side(covered, 0), side(covered, 1), width};
    {
        const py::gil_scoped_release released;
        compute_coverage(points, counts, options, texels);
    }
    return covered;
}

py::tuple gather(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, int rays, std::uint32_t seed,
                 int threads, const py::object& callback, double clearance, int even_rays, int samples,
                 bool find_shadows)
{
    RaySum sum(grid.width * grid.height, 3, true);
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
    const auto to_vectors = [&](auto values) {
        return to_array<float>(std::move(values), {grid.height, grid.width, 3});
    };
    return py::make_tuple(to_vectors(std::move(sum.irradiance)), to_vectors(std::move(sum.flow)));
}

NodeGrid node_grid(const py::dict& grid)
{
    const auto vector = [&grid](const char* name) { return to_vec3(name, py::cast<Numbers>(grid[name])); };
    const auto size = py::cast<std::array<double, 2>>(grid["size"]);
    const auto nodes = py::cast<std::array<std::size_t, 2>>(grid["nodes"]);
    return {.corner = vector("corner"),
            .x_axis = vector("x_axis"),
            .y_axis = vector("y_axis"),
            .normal = vector("normal"),
            .size = {size[0], size[1]},
            .columns = nodes[0],
            .rows = nodes[1]};
}

// Positions or normals of nodes, (N, 3).
Array<double> node_vectors(const std::vector<Vec3>& vectors)
{
    return to_array<double>(std::vector<Vec3>(vectors), {vectors.size(), std::size_t{3}});
}

// Places above the texels of each node, evenly spread over its area, and the normals there.
py::tuple node_starts(const BentNodes& nodes, std::size_t count)
{
    if (count < 1 || count > 64)
        reject("count", std::to_string(count), "1 to 64 places");
    std::vector<Vec3> origins, normals;
    for (std::size_t node = 0; node < nodes.size(); ++node) {
        for (std::size_t i = 0; i < count; ++i) {
            const BentNodes::Start start =
                nodes.start(node, (static_cast<double>(i) + 0.5) / static_cast<double>(count));
            origins.push_back(start.origin);
            normals.push_back(start.frame.z);
        }
    }
    const auto array = [&](std::vector<Vec3>&& vectors) {
        return to_array<double>(std::move(vectors), {nodes.size(), count, std::size_t{3}});
    };
    return py::make_tuple(array(std::move(origins)), array(std::move(normals)));
}

// Radiance (K, N, 3) at the nodes of a mesh.
Array<float> without_repeats(const std::vector<Vec3f>& radiance, const NodeGrid& grid)
{
    const std::size_t parts = radiance.size() / grid.nodes();
    std::vector<Vec3f> at_nodes;
    for (std::size_t k = 0; k < parts; ++k) {
        const auto first = radiance.begin() + static_cast<std::ptrdiff_t>(k * grid.nodes());
        at_nodes.insert(at_nodes.end(), first, first + static_cast<std::ptrdiff_t>(grid.different()));
    }
    return to_array<float>(std::move(at_nodes), {parts, grid.different(), std::size_t{3}});
}

py::dict bounced_light(const std::vector<py::object>& grids, const Numbers& strata,
                       const std::vector<std::tuple<const Light*, Numbers, const Occluders*>>& lights,
                       const Occluders* occluders, double direct, double tolerance,
                       const std::variant<int, std::array<int, 3>>& max_bounces, std::uint32_t seed, int threads,
                       const py::object& callback, double spread, int max_samples, double max_rays)
{
    std::vector<NodeGrid> node_grids;
    for (const py::object& grid : grids)
        node_grids.push_back(py::isinstance<BentNodes>(grid) ? NodeGrid::of(py::cast<const BentNodes&>(grid))
                                                             : node_grid(py::cast<py::dict>(grid)));
    if (strata.ndim() != 2 || strata.shape(1) != 4 || strata.shape(0) < 1)
        reject("strata", shape_text(strata), "(K, 4) numbers");
    std::vector<Stratum> parts;
    for (py::ssize_t k = 0; k < strata.shape(0); ++k)
        parts.push_back({strata.at(k, 0), strata.at(k, 1), strata.at(k, 2), strata.at(k, 3)});
    std::vector<SceneLight> scene_lights;
    for (const auto& [light, color, blockers] : lights)
        scene_lights.push_back({light, Vec3f(to_vec3("color", color)), blockers});
    const int* const same = std::get_if<int>(&max_bounces);
    const auto [all, diffuse, glossy] = same ? std::array{*same, *same, *same} : std::get<1>(max_bounces);
    const BouncedSettings settings{.direct = direct,
                                   .tolerance = tolerance,
                                   .spread = spread,
                                   .limits = {.all = all, .diffuse = diffuse, .glossy = glossy},
                                   .max_samples = max_samples,
                                   .max_rays = max_rays,
                                   .seed = seed,
                                   .threads = threads};
    Progress progress(progress_callback(callback));
    BouncedLight light;
    {
        const py::gil_scoped_release released;
        light = trace_bounced_light(node_grids, parts, scene_lights, occluders, settings, progress);
    }
    py::list radiance;
    for (std::size_t n = 0; n < node_grids.size(); ++n) {
        const NodeGrid& grid = node_grids[n];
        if (grid.bent)
            radiance.append(without_repeats(light.radiance[n], grid));
        else
            radiance.append(
                to_array<float>(std::move(light.radiance[n]), {parts.size(), grid.rows, grid.columns, std::size_t{3}}));
    }
    py::dict result;
    result["radiance"] = radiance;
    result["irradiance"] = light.irradiance;
    result["noise"] = light.noise;
    result["paths"] = light.paths;
    return result;
}

}  // namespace

void bind_scene(py::module_& m)
{
    bind_occluders(m);
    py::class_<ReceiverGrid>(
        m, "ReceiverGrid",
        R"(The plane that receives light, divided into texels; `bent` makes the grid of a mesh that bends.

Parameters
----------
origin : 3 floats
    World position, in metres, of the outer corner of texel (0, 0).
x_axis, y_axis, normal : 3 floats each
    Unit vectors at right angles in the world: along a row of texels, from row to row, and out of the lit side. A
    mirrored texture makes them left-handed.
pitch_x, pitch_y : float
    Size of a texel in metres.
width, height : int
    Texels, 1 to 65536.
owner : int
    Number of the object that the plane belongs to, as in `OccluderMesh`. Faces of other objects that lie on the plane
    block its light.

Raises
------
ValueError
    An argument is out of range; the message names it.
)")
        .def(py::init(&make_grid), py::arg("origin"), py::arg("x_axis"), py::arg("y_axis"), py::arg("normal"),
             py::arg("pitch_x"), py::arg("pitch_y"), py::arg("width"), py::arg("height"), py::arg("owner") = 0)
        .def_static("bent", &make_bent_grid, py::arg("positions"), py::arg("steps_x"), py::arg("steps_y"),
                    py::arg("normals"), py::arg("tangents"), py::arg("areas"), py::arg("owner") = 0,
                    R"(The texels of a mesh that bends, which shadows itself.

A texel lies on one face of the mesh: its points are position + (u - 1/2) steps_x + (v - 1/2) steps_y, u and v from 0 to 1.
Light from behind that face does not arrive, whatever the shading normal. All arrays are C-contiguous and copied.

Parameters
----------
positions : ndarray, float64, shape (H, W, 3)
    World position, in metres, of the middle of the part of the mesh that each texel shows.
steps_x, steps_y : ndarray, float32, shape (H, W, 3)
    World steps of one texel along the columns and up the rows, metres, in the plane of the texel's face.
normals : ndarray, float32, shape (H, W, 3)
    Shading normals, unit vectors toward the lit side; 0 for texels outside of the mesh, which get no light.
tangents : ndarray, float32, shape (H, W, 3)
    Unit vectors along the columns; their part along the normal is removed. The frame of a texel is tangent, cross(normal,
    tangent), normal.
areas : ndarray, float32, shape (H, W)
    Area of the part of the mesh that each texel shows, m^2.
owner : int
    Number of the object, as in `OccluderMesh`.

Returns
-------
ReceiverGrid

Raises
------
ValueError
    An argument is out of range; the message names it.
)")
        .def_property_readonly(
            "is_bent", [](const ReceiverGrid& grid) { return grid.is_bent(); }, "bool: True if `bent` made the grid.");

    py::class_<BentNodes>(m, "BentNodes", R"(Coarse nodes of a mesh that bends, for light that surfaces reflect to it.

Each node is a group of texels of like place and normal; paths start from one of them. Directions at a node, and at each
texel, are in a frame that changes smoothly with the normal n: x = (1 - n.x^2 a, b, -n.x), y = (b, 1 - n.y^2 a, -n.y) and n,
with a = 1 / (1 + n.z) and b = -n.x n.y a.

Parameters
----------
grid : ReceiverGrid
    Of `ReceiverGrid.bent`.
count : int
    Number of nodes, about.

Raises
------
ValueError
    The grid is a plane or without texels, or `count` is below 1.
)")
        .def(py::init([](const ReceiverGrid& grid, std::size_t count) {
                 const py::gil_scoped_release released;
                 return std::make_unique<BentNodes>(grid, count);
             }),
             py::arg("grid"), py::arg("count"))
        .def_property_readonly(
            "positions", [](const BentNodes& nodes) { return node_vectors(nodes.cloud().positions()); },
            "ndarray, float64, shape (N, 3): world, metres.")
        .def_property_readonly(
            "normals", [](const BentNodes& nodes) { return node_vectors(nodes.cloud().normals()); },
            "ndarray, float64, shape (N, 3): unit vectors.")
        .def_property_readonly(
            "spacing", [](const BentNodes& nodes) { return nodes.cloud().spacing(); },
            "float: distance of neighbors, about, metres.")
        .def("starts", &node_starts, py::arg("count"),
             R"(Places where light arrives at each node, slightly above its texels.

Parameters
----------
count : int
    Places in each node, 1 to 64, evenly spread over its area.

Returns
-------
positions, normals : ndarray, float64, shape (N, count, 3)
    World, metres, and unit vectors.

Raises
------
ValueError
    `count` is out of range.
)");

    bind_lights(m);
    m.def("coverage", &coverage, py::arg("corners"), py::arg("corner_counts"), py::arg("width"), py::arg("height"),
          py::arg("threads") = 0, py::arg("row_step") = 1, py::arg("is_cut") = true,
          R"(The exact part of each texel of a grid that polygons cover.

Parameters
----------
corners : ndarray, float64, shape (N, 2), C-contiguous
    The corners of all polygons, one after the other, in texels: texel (row y, column x) spans [x, x+1] x [y, y+1].
    Polygons may be concave, have either orientation and reach beyond the grid.
corner_counts : ndarray, uint32, shape (P,), C-contiguous
    Number of corners of each polygon, 3 or more.
width, height : int
    Size of the grid, texels.
threads : int
    0: all.
row_step : int
    With 2 and more, row i of the grid is one of the texel rows from i * row_step up to the next multiple: a probe of
    a grid with row_step as many rows, in as small a part of the time.
is_cut : bool
    True if the sum of overlapping polygons is cut at 1.

Returns
-------
coverage : ndarray, float32, shape (height, width)
    0 to 1; more where polygons overlap and `is_cut` is false.

Raises
------
ValueError
    An argument is out of range; the message names it.
)");
    m.def("gather_rays", &gather, py::arg("grid"), py::arg("light"), py::arg("occluders") = py::none(),
          py::arg("rays") = 16, py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("clearance") = 0.0, py::arg("even_rays") = 0, py::arg("samples") = 4, py::arg("find_shadows") = true,
          R"(Irradiance of a receiver by a light, and its mean direction.

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
    receiver's own faces to the plane, where they are among the occluders. On a mesh that bends the height above the face
    of each texel.
even_rays : int
    Rays of a first pass. They are enough in texels that, with their neighbors, see only light or only obstacles; `rays`
    are traced from all others. 0: no first pass.
samples : int
    For a light without a size, samples x samples points in each texel, each with its own visibility; 1 to 64.
find_shadows : bool
    False: rays are traced from every texel, also where none can be blocked, or where one triangle blocks all those to
    a light without a size. The result is the same; for measurements.

Returns
-------
irradiance : ndarray, float32, shape (height, width, 3)
    W/m^2: cosine and visible part included. Row 0 is the lowest row.
flow : ndarray, float32, shape (height, width, 3)
    Sum over the rays of irradiance, the mean of its channels, times the unit vector of travel in the plane frame
    (x_axis, y_axis, normal) or in the frame of the texel, W/m^2.

Raises
------
ValueError
    An argument is out of range; the message names it.
Cancelled
    `progress` returned False.
)");
    m.def("bounced_light", &bounced_light, py::arg("grids"), py::arg("strata"), py::arg("lights"), py::arg("occluders"),
          py::arg("direct"), py::arg("tolerance") = 0.01, py::arg("max_bounces") = 12, py::arg("seed") = 0,
          py::arg("threads") = 0, py::arg("progress") = py::none(), py::arg("spread") = 0.0,
          py::arg("max_samples") = BouncedSettings{}.max_samples, py::arg("max_rays") = BouncedSettings{}.max_rays,
          R"(Light that surfaces reflect to receivers, by path tracing with next-event estimation.

Parameters
----------
grids : list of dict or BentNodes
    Rectangles of nodes above the receivers: 'corner', 'x_axis', 'y_axis', 'normal' (3 floats each, world, metres), 'size'
    (2 floats, metres) and 'nodes' (columns, rows); or the nodes of meshes that bend.
strata : array of float, shape (K, 4)
    Parts of the hemisphere: begin and extent of the squared sine, and of the azimuth over 2 pi.
lights : list of (Light, 3 floats, Occluders or None)
    All lights of the scene, their colored strengths, and the triangles that block each.
occluders : Occluders or None
    Triangles that reflect light.
direct : float
    Mean irradiance of direct light, W/m^2.
tolerance : float
    Allowed noise, relative to direct and bounced irradiance.
max_bounces : int or 3 ints
    Largest number of surfaces that reflect light on its way to a receiver: in all, by Lambert's law, and by a lobe. These are
    Cycles' numbers of bounces, total, diffuse and glossy.
seed : int
threads : int
    0: all. The result is the same, bit for bit, for any number.
progress : callable, optional
    progress(fraction) returns False to stop.
spread : float
    Radius, metres, over which the medium averages light: noise counts as its mean over that distance.
max_samples : int
    Largest number of paths from each node in each part of the hemisphere.
max_rays : float
    About the largest number of rays along all paths, shadow rays not counted.

Returns
-------
dict
    'radiance': float32 (K, rows, columns, 3) for each grid, mean over each part weighted by the cosine, W/(m^2 sr);
    (K, N, 3) for the N nodes of a mesh;
    'irradiance': its mean, W/m^2; 'noise': root mean square error of the irradiance after that averaging and the spline
    between nodes, relative to direct and bounced irradiance; 'paths': number of paths.

Raises
------
ValueError
    An argument is out of range; the message names it.
)");
}

}  // namespace beamspread
