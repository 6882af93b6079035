// Python names of the lights in native/scene.
#include <memory>
#include <optional>
#include <vector>

#include "base/constants.h"
#include "python/casters.h"
#include "scene/area_light.h"
#include "scene/closed_mesh.h"
#include "scene/environment_light.h"
#include "scene/mesh_light.h"
#include "scene/spot_light.h"
#include "scene/sun_light.h"

namespace beamspread {

namespace {

BallShape to_shape(const std::string& name)
{
    return named<BallShape>("shape", name, {{"sphere", BallShape::sphere}, {"disk", BallShape::disk}});
}

std::unique_ptr<SunLight> make_sun(const Numbers& direction, double angle, const std::string& disk)
{
    const auto kind = named<SunDisk>("disk", disk, {{"even", SunDisk::even}, {"flat", SunDisk::flat}});
    return std::make_unique<SunLight>(to_vec3("direction", direction), angle, kind);
}

std::unique_ptr<PointLight> make_point(const Numbers& position, double radius, const std::string& shape)
{
    return std::make_unique<PointLight>(to_vec3("position", position), radius, to_shape(shape));
}

std::unique_ptr<SpotLight> make_spot(const Numbers& position, const Numbers& frame, double spot_size, double blend,
                                     const std::string& falloff, double radius, const std::string& shape)
{
    const auto kind =
        named<SpotFalloff>("falloff", falloff, {{"scaled", SpotFalloff::scaled}, {"legacy", SpotFalloff::legacy}});
    const SpotCone cone(to_axes("frame", frame), spot_size, blend, kind);
    return std::make_unique<SpotLight>(to_vec3("position", position), cone, radius, to_shape(shape));
}

std::unique_ptr<AreaLight> make_area(const Numbers& position, const Numbers& frame, double size_x, double size_y,
                                     bool is_round, double spread)
{
    return std::make_unique<AreaLight>(to_vec3("position", position), to_axes("frame", frame), size_x, size_y, is_round,
                                       spread);
}

std::unique_ptr<EnvironmentLight> make_environment(const py::array& radiance, const Numbers& to_world)
{
    if (!py::isinstance<Array<float>>(radiance) || radiance.ndim() != 3 || radiance.shape(2) != 3 ||
        radiance.size() == 0)
        reject("radiance", shape_text(radiance), "contiguous float32 (H, W, 3) with a pixel or more");
    const View2D<const Vec3f> pixels{static_cast<const Vec3f*>(radiance.data()),
                                     static_cast<std::size_t>(radiance.shape(0)),
                                     static_cast<std::size_t>(radiance.shape(1)), radiance.shape(1)};
    // `to_axes` makes columns of the matrix's rows.
    return std::make_unique<EnvironmentLight>(pixels, glm::transpose(to_axes("to_world", to_world)));
}

std::unique_ptr<MeshLight> make_mesh_light(const py::array& vertices, const py::array& triangles,
                                           const py::array& radiance, bool is_closed)
{
    return std::make_unique<MeshLight>(to_vertices(vertices), to_triangles(triangles),
                                       to_rows<Vec3f, float>("radiance", radiance, "contiguous float32 (M, 3)"),
                                       is_closed);
}

bool is_closed_mesh(const py::array& vertices, const py::array& triangles, const std::optional<py::array>& glowing)
{
    const auto corners = to_vertices(vertices);
    const auto faces = to_triangles(triangles);
    std::optional<std::span<const std::uint32_t>> starts;
    if (glowing)
        starts = to_rows<std::uint32_t, std::uint32_t>("glowing", *glowing, "contiguous uint32 (K, 1)");
    const py::gil_scoped_release released;
    return is_closed(corners, faces, starts);
}

}  // namespace

void bind_lights(py::module_& m)
{
    py::class_<Light>(m, "Light", R"(A light of strength 1 without color, with or without a size.

Its kinds are SunLight, PointLight, SpotLight, AreaLight, EnvironmentLight and MeshLight. Each raises ValueError for an
argument that is out of range, with a message that names it.
)")
        .def_property_readonly("is_colored", &Light::is_colored, "bool: True if its rays differ in color.");

    py::class_<SunLight, Light>(m, "SunLight", R"(A sun of 1 W/m^2 at normal incidence.

Parameters
----------
direction : 3 floats
    World direction of travel from the disk's center, any length but 0.
angle : float
    Full angle of the disk in radians, 0 to pi.
disk : str
    "even": of even radiance, and 1 W/m^2 at normal incidence, as Cycles in Blender 4.5. "flat": each part of a flat
    disk gives the same flux, as in 3.4; E at normal incidence is smaller, by 1.7 % for an angle of 30 degrees.
)")
        .def(py::init(&make_sun), py::arg("direction"), py::arg("angle") = 0.0, py::arg("disk") = "even")
        .def_readonly_static(
            "max_parallel_angle", &SunLight::max_parallel_angle,
            "float: largest angle, radians, of a sun that counts as parallel light but for its shadows.");

    py::class_<PointLight, Light>(m, "PointLight", R"(A point lamp of 1 W.

Parameters
----------
position : 3 floats
    World position of its center, metres.
radius : float
    Metres, 0 or more.
shape : str
    "sphere"; or "disk", which faces each point that it lights.
)")
        .def(py::init(&make_point), py::arg("position"), py::arg("radius") = 0.0, py::arg("shape") = "sphere");

    py::class_<SpotLight, Light>(m, "SpotLight", R"(A spot lamp of 1 W over the whole sphere, as in Blender.

Parameters
----------
position : 3 floats
    World position of its center, metres.
frame : (3, 3) floats
    Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
    along -z.
spot_size : float
    Full angle of the cone in radians, 0 < spot_size <= pi.
blend : float
    Soft part of the cone, 0 to 1.
falloff : str
    "scaled": as Cycles in Blender 4.2, 4.5 and 5.0, where the lamp's scale shapes the cone. "legacy": as in 3.4, where
    the scale does not count, and light also falls off with the cosine to the axis.
radius, shape
    As for `PointLight`.
)")
        .def(py::init(&make_spot), py::arg("position"), py::arg("frame"), py::arg("spot_size"), py::arg("blend"),
             py::arg("falloff") = "scaled", py::arg("radius") = 0.0, py::arg("shape") = "sphere");

    py::class_<AreaLight, Light>(m, "AreaLight", R"(An area lamp of 1 W, whose radiance is 1 W / (4 area).

Parameters
----------
position : 3 floats
    World position of its center, metres.
frame : (3, 3) floats
    Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
    along -z.
size_x, size_y : float
    Whole lengths along its own axes, 0 or more; a lamp without an area is dark.
is_round : bool
    True for an ellipse, False for a rectangle.
spread : float
    Full angle in which light leaves, radians, 0 to pi.
)")
        .def(py::init(&make_area), py::arg("position"), py::arg("frame"), py::arg("size_x"), py::arg("size_y"),
             py::arg("is_round") = false, py::arg("spread") = pi);

    py::class_<EnvironmentLight, Light>(m, "EnvironmentLight", R"(Light from all directions.

Parameters
----------
radiance : ndarray, float32, shape (H, W, 3), C-contiguous
    W/(m^2 sr), 0 or more, equirectangular: from row 0 up the elevation rises from -pi/2 to pi/2, along a row the
    azimuth falls from pi to -pi. Copied.
to_world : (3, 3) floats
    Matrix that turns directions of the image into the world.
)")
        .def(py::init(&make_environment), py::arg("radiance"), py::arg("to_world"));

    py::class_<MeshLight, Light>(m, "MeshLight", R"(Triangles that glow on both sides.

Parameters
----------
vertices : ndarray, float64, shape (N, 3), C-contiguous
    World positions in metres. Copied. Those of a closed mesh whose faces do not all glow belong to its bounding box.
triangles : ndarray, uint32, shape (M, 3), C-contiguous
    Vertex indices. Copied.
radiance : ndarray, float32, shape (M, 3), C-contiguous
    Radiance of each triangle, W/(m^2 sr), 0 or more. Copied.
is_closed : bool
    True if from outside of the vertices' bounding box fronts hide all backs: the mesh is closed (`is_closed`), blocks
    light and is not see-through. Fronts are those from which a triangle's vertices are seen counterclockwise. Then no
    ray from there tries the backs.
)")
        .def(py::init(&make_mesh_light), py::arg("vertices"), py::arg("triangles"), py::arg("radiance"),
             py::arg("is_closed") = false);

    m.def("is_closed", &is_closed_mesh, py::arg("vertices"), py::arg("triangles"), py::arg("glowing") = py::none(),
          R"(True if from outside a mesh the fronts of its triangles hide their backs.

The mesh has no border, no triangle lies on another, and rays from 4096 places on backs all meet it again; of their
area, parts of less than two thousandths that are inside out may be missed. Vertices at the same position count as one.

Parameters
----------
vertices : ndarray, float64, shape (N, 3), C-contiguous
triangles : ndarray, uint32, shape (M, 3), C-contiguous
    Vertex indices.
glowing : ndarray, uint32, shape (K, 1), C-contiguous, or None
    Indices of the triangles from whose backs rays start; None: all.

Raises
------
ValueError
    Wrong dtype or shape, a position that is not finite, an index out of range.
)");
}

}  // namespace beamspread
