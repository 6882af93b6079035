// Python names of the lights without size in native/scene: Light, SunLight, PointLight, SpotLight.
#include <memory>
#include <optional>

#include "python/spot.h"
#include "python/vectors.h"
#include "scene/point_light.h"
#include "scene/receiver.h"
#include "scene/spot_light.h"
#include "scene/sun_light.h"

namespace beamspread {

namespace {

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
}

}  // namespace beamspread
