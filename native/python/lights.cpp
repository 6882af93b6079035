// Python names of the lights in native/scene.
#include <memory>
#include <optional>
#include <vector>

#include "base/constants.h"
#include "python/vectors.h"
#include "scene/area_light.h"
#include "scene/environment_light.h"
#include "scene/light.h"
#include "scene/mesh_light.h"
#include "scene/receiver.h"
#include "scene/sphere_spot_light.h"
#include "scene/sun_disk_light.h"

namespace beamspread {

namespace {

SpotCone to_spot_cone(const Numbers& frame, double spot_size, double blend, const std::string& falloff)
{
    const auto kind =
        named<SpotFalloff>("falloff", falloff, {{"scaled", SpotFalloff::scaled}, {"legacy", SpotFalloff::legacy}});
    return {to_axes("frame", frame), spot_size, blend, kind};
}

std::unique_ptr<SunLight> make_sun(const Numbers& direction)
{
    return std::make_unique<SunLight>(to_vec3("direction", direction));
}

std::unique_ptr<PointLight> make_point(const Numbers& position)
{
    return std::make_unique<PointLight>(to_vec3("position", position));
}

std::unique_ptr<SpotLight> make_spot(const Numbers& position, const Numbers& frame, double spot_size, double blend,
                                     const std::string& falloff)
{
    return std::make_unique<SpotLight>(to_vec3("position", position), to_spot_cone(frame, spot_size, blend, falloff));
}

std::optional<py::tuple> position_in(const Light& light, const ReceiverGrid& grid)
{
    const LightSource source = light.source();
    if (source.is_far)
        return std::nullopt;
    const Vec3 position = grid.to_plane(source.position - grid.origin);
    return py::make_tuple(position.x, position.y, position.z);
}

std::unique_ptr<SunDiskLight> make_sun_disk(const Numbers& direction, double angle, const std::string& disk)
{
    const auto kind = named<SunDisk>("disk", disk, {{"even", SunDisk::even}, {"flat", SunDisk::flat}});
    return std::make_unique<SunDiskLight>(to_vec3("direction", direction), angle, kind);
}

SphereModel to_model(const std::string& name)
{
    return named<SphereModel>("model", name, {{"sphere", SphereModel::sphere}, {"disk", SphereModel::disk}});
}

std::unique_ptr<SphereLight> make_sphere(const Numbers& position, double radius, const std::string& model)
{
    return std::make_unique<SphereLight>(to_vec3("position", position), radius, to_model(model));
}

std::unique_ptr<SphereSpotLight> make_sphere_spot(const Numbers& position, const Numbers& frame, double spot_size,
                                                  double blend, const std::string& falloff, double radius,
                                                  const std::string& model)
{
    return std::make_unique<SphereSpotLight>(to_vec3("position", position),
                                             to_spot_cone(frame, spot_size, blend, falloff), radius, to_model(model));
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
    // Its rows are those of the matrix.
    return std::make_unique<EnvironmentLight>(pixels, glm::transpose(to_axes("to_world", to_world)));
}

std::unique_ptr<MeshLight> make_mesh_light(const py::array& vertices, const py::array& triangles,
                                           const py::array& radiance)
{
    return std::make_unique<MeshLight>(to_vertices(vertices), to_triangles(triangles),
                                       to_rows<Vec3f, float>("radiance", radiance, "contiguous float32 (M, 3)"));
}

py::tuple irradiance(const ExtendedLight& light, const Numbers& point, const Numbers& normal)
{
    const Vec3 light_there = light.irradiance(to_vec3("point", point), to_vec3("normal", normal));
    return py::make_tuple(light_there.x, light_there.y, light_there.z);
}

py::tuple sample(const ExtendedLight& light, const Numbers& point, const Numbers& normal, const py::array& square)
{
    const auto places = to_rows<Vec2, double>("square", square, "contiguous float64 (N, 2)");
    std::vector<LightRay> rays(places.size());
    light.sample(to_vec3("point", point), to_vec3("normal", normal), places, rays.data());
    const auto count = static_cast<py::ssize_t>(rays.size());
    Array<double> travel({count, py::ssize_t{3}});
    Array<double> distance(count);
    Array<float> flux({count, py::ssize_t{3}});
    for (py::ssize_t i = 0; i < count; ++i) {
        const LightRay& ray = rays[static_cast<std::size_t>(i)];
        distance.mutable_at(i) = ray.distance;
        for (int k = 0; k < 3; ++k) {
            travel.mutable_at(i, k) = ray.travel[k];
            flux.mutable_at(i, k) = ray.flux[k];
        }
    }
    return py::make_tuple(travel, distance, flux);
}

}  // namespace

void bind_lights(py::module_& m)
{
    py::class_<Light>(m, "Light",
                      R"(A light of strength 1 without colour; its kinds are SunLight, PointLight, SpotLight.

Each raises ValueError for an argument that is out of range, with a message that names it.
)")
        .def("position_in", &position_in, py::arg("grid"), R"(Where all of the light comes from.

Parameters
----------
grid : ReceiverGrid

Returns
-------
tuple of 3 floats or None
    Metres along the grid's x_axis, y_axis and normal from the outer corner of texel (0, 0); None: a light infinitely
    far away.
)");

    py::class_<SunLight, Light>(m, "SunLight", R"(Parallel light of 1 W/m^2 at normal incidence.

Parameters
----------
direction : 3 floats
    Of travel in the world, any length but 0.
)")
        .def(py::init(&make_sun), py::arg("direction"));

    py::class_<PointLight, Light>(m, "PointLight", R"(A point lamp of 1 W.

Parameters
----------
position : 3 floats
    In the world, metres.
)")
        .def(py::init(&make_point), py::arg("position"));

    py::class_<SpotLight, Light>(m, "SpotLight", R"(A spot lamp of 1 W over the whole sphere, as Blender counts it.

Parameters
----------
position : 3 floats
    In the world, metres.
frame : (3, 3) floats
    Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
    along -z.
spot_size : float
    Full angle of the cone in radians, 0 < spot_size <= pi.
blend : float
    Soft part of the cone, 0 to 1.
falloff : str
    "scaled": as Cycles in Blender 4.2, 4.5 and 5.0, where the lamp's scale shapes the cone. "legacy": as in 3.4, where
    it does not, and light falls off with the cosine to the axis besides.
)")
        .def(py::init(&make_spot), py::arg("position"), py::arg("frame"), py::arg("spot_size"), py::arg("blend"),
             py::arg("falloff") = "scaled");

    py::class_<ExtendedLight>(m, "ExtendedLight", R"(A light of a size; its kinds are SunDiskLight, SphereLight,
SphereSpotLight, AreaLight, EnvironmentLight and MeshLight. Each raises ValueError for an argument that is out of range,
with a message that names it.
)")
        .def_property_readonly("is_colored", &ExtendedLight::is_colored, "bool: whether its rays differ in colour.")
        .def("irradiance", &irradiance, py::arg("point"), py::arg("normal"),
             R"(What reaches a point with nothing in between.

Parameters
----------
point : 3 floats
    In the world, metres.
normal : 3 floats
    Unit vector out of the lit side of the plane there.

Returns
-------
tuple of 3 floats
    W/m^2 in each channel.
)")
        .def("sample", &sample, py::arg("point"), py::arg("normal"), py::arg("square"),
             R"(Rays from a point towards the light.

Parameters
----------
point, normal
    Those of `irradiance`.
square : ndarray, float64, shape (N, 2), C-contiguous
    Places in the unit square; even ones give the density of rays that `flux` stands for.

Returns
-------
travel : ndarray, float64, shape (N, 3)
    Unit vectors along which the light travels, world.
distance : ndarray, float64, shape (N,)
    To the light, metres.
flux : ndarray, float32, shape (N, 3)
    W/m^2 on a square metre that faces the ray, over the density of rays: the mean of flux times cosine to the normal is
    the irradiance.
)");

    py::class_<SunDiskLight, ExtendedLight>(m, "SunDiskLight", R"(Light of 1 W/m^2 from a disk infinitely far away.

Parameters
----------
direction : 3 floats
    Of travel in the world from the disk's centre, any length but 0.
angle : float
    Full angle of the disk in radians, 0 to pi.
disk : str
    "even": of even radiance, and 1 W/m^2 at normal incidence, as Cycles in Blender 4.5. "flat": each part of a flat
    disk gives the same flux, as in 3.4; E at normal incidence is smaller, by 1.7 % for an angle of 30 degrees.
)")
        .def(py::init(&make_sun_disk), py::arg("direction"), py::arg("angle"), py::arg("disk") = "even");

    py::class_<SphereLight, ExtendedLight>(m, "SphereLight", R"(A point lamp of 1 W with a radius.

Parameters
----------
position : 3 floats
    Of its centre in the world, metres.
radius : float
    In metres, 0 or more.
model : str
    "sphere"; or "disk", which faces each point that it lights.
)")
        .def(py::init(&make_sphere), py::arg("position"), py::arg("radius"), py::arg("model"));

    py::class_<SphereSpotLight, ExtendedLight>(m, "SphereSpotLight", R"(A spot lamp of 1 W with a radius.

Parameters
----------
position, frame, spot_size, blend, falloff
    Those of `SpotLight`.
radius, model
    Those of `SphereLight`.
)")
        .def(py::init(&make_sphere_spot), py::arg("position"), py::arg("frame"), py::arg("spot_size"), py::arg("blend"),
             py::arg("falloff"), py::arg("radius"), py::arg("model"));

    py::class_<AreaLight, ExtendedLight>(m, "AreaLight",
                                         R"(An area lamp of 1 W as Blender counts it: of the radiance 1 W / (4 area).

Parameters
----------
position : 3 floats
    Of its centre in the world, metres.
frame : (3, 3) floats
    Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
    along -z.
size_x, size_y : float
    Whole lengths along its own axes, 0 or more; without an area it is dark.
is_round : bool
    An ellipse instead of a rectangle.
spread : float
    Full angle that light leaves in, radians, 0 to pi.
)")
        .def(py::init(&make_area), py::arg("position"), py::arg("frame"), py::arg("size_x"), py::arg("size_y"),
             py::arg("is_round") = false, py::arg("spread") = pi);

    py::class_<EnvironmentLight, ExtendedLight>(m, "EnvironmentLight", R"(Light from all directions.

Parameters
----------
radiance : ndarray, float32, shape (H, W, 3), C-contiguous
    W/(m^2 sr), 0 or more, equirectangular: from row 0 up the elevation rises from -pi/2 to pi/2, along a row the
    azimuth falls from pi to -pi. Copied.
to_world : (3, 3) floats
    Matrix that turns directions of the image into the world.
)")
        .def(py::init(&make_environment), py::arg("radiance"), py::arg("to_world"));

    py::class_<MeshLight, ExtendedLight>(m, "MeshLight", R"(Triangles that glow on both sides.

Parameters
----------
vertices : ndarray, float64, shape (N, 3), C-contiguous
    World positions in metres. Copied.
triangles : ndarray, uint32, shape (M, 3), C-contiguous
    Vertex indices. Copied.
radiance : ndarray, float32, shape (M, 3), C-contiguous
    Of each triangle, W/(m^2 sr), 0 or more. Copied.
)")
        .def(py::init(&make_mesh_light), py::arg("vertices"), py::arg("triangles"), py::arg("radiance"));
}

}  // namespace beamspread
