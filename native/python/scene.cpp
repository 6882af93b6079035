// Python names of native/scene: Occluders, sun_beams, point_beams, spot_beams, coverage.
#include <optional>

#include "base/error.h"
#include "python/casters.h"
#include "scene/beams.h"
#include "scene/coverage.h"

namespace beamspread {

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::string shape_text(const py::array& array)
{
    return std::string(py::str(array.dtype())) + " of shape " + std::string(py::str(array.attr("shape")));
}

Vec3 to_vec3(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 1 || numbers.size() != 3)
        reject(name, shape_text(numbers), "3 numbers");
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

// Rows of the array become columns of the matrix: both are the lamp's axes.
Mat3 to_axes(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 2 || numbers.shape(0) != 3 || numbers.shape(1) != 3)
        reject(name, shape_text(numbers), "3 x 3 numbers");
    Mat3 axes;
    for (int i = 0; i < 3; ++i)
        axes[i] = {numbers.at(i, 0), numbers.at(i, 1), numbers.at(i, 2)};
    return axes;
}

SpotFalloff to_falloff(const std::string& name)
{
    if (name == "scaled")
        return SpotFalloff::scaled;
    if (name == "legacy")
        return SpotFalloff::legacy;
    reject("falloff", "'" + name + "'", "'scaled' or 'legacy'");
}

// A big array: its type is never converted silently.
template <class T>
std::span<const T> to_rows(const std::string& name, const py::array& array, py::ssize_t columns,
                           const std::string& allowed)
{
    if (!py::isinstance<Array<T>>(array) || array.ndim() != 2 || array.shape(1) != columns)
        reject(name, shape_text(array), allowed);
    return {static_cast<const T*>(array.data()), static_cast<std::size_t>(array.size())};
}

ReceiverGrid to_grid(const Numbers& origin, const Numbers& x_axis, const Numbers& y_axis, const Numbers& normal,
                     double pitch_x, double pitch_y, py::ssize_t width, py::ssize_t height)
{
    // Negative sizes become huge ones, which the check refuses.
    const ReceiverGrid grid{.origin = to_vec3("origin", origin),
                            .x_axis = to_vec3("x_axis", x_axis),
                            .y_axis = to_vec3("y_axis", y_axis),
                            .normal = to_vec3("normal", normal),
                            .pitch_x = pitch_x,
                            .pitch_y = pitch_y,
                            .width = static_cast<std::size_t>(width),
                            .height = static_cast<std::size_t>(height)};
    grid.check();
    return grid;
}

Array<float> make_array(const ReceiverGrid& grid)
{
    return Array<float>({static_cast<py::ssize_t>(grid.height), static_cast<py::ssize_t>(grid.width)});
}

View2D<float> view(Array<float>& array, const ReceiverGrid& grid)
{
    return {array.mutable_data(), grid.height, grid.width, static_cast<std::ptrdiff_t>(grid.width)};
}

void run(const ReceiverGrid& grid, const Light& light, const Occluders* occluders, const BeamSettings& settings,
         const py::object& callback, const BeamArrays& beams)
{
    Progress progress(progress_callback(callback));
    const py::gil_scoped_release released;
    compute_beams(grid, light, occluders, settings, beams, progress);
}

py::tuple beams_with_direction(const ReceiverGrid& grid, const Light& light, const Occluders* occluders,
                               const BeamSettings& settings, const py::object& callback)
{
    Array<float> irradiance = make_array(grid);
    Array<float> direction(
        {static_cast<py::ssize_t>(grid.height), static_cast<py::ssize_t>(grid.width), py::ssize_t{3}});
    static_assert(sizeof(Vec3f) == 3 * sizeof(float));
    const BeamArrays beams{.irradiance = view(irradiance, grid),
                           .direction = {reinterpret_cast<Vec3f*>(direction.mutable_data()), grid.height, grid.width,
                                         static_cast<std::ptrdiff_t>(grid.width)}};
    run(grid, light, occluders, settings, callback, beams);
    return py::make_tuple(irradiance, direction);
}

Array<float> sun_beams(const Numbers& origin, const Numbers& x_axis, const Numbers& y_axis, const Numbers& normal,
                       double pitch_x, double pitch_y, py::ssize_t width, py::ssize_t height, const Numbers& direction,
                       const Occluders* occluders, int samples, int threads, const py::object& progress,
                       double clearance)
{
    const ReceiverGrid grid = to_grid(origin, x_axis, y_axis, normal, pitch_x, pitch_y, width, height);
    Array<float> irradiance = make_array(grid);
    run(grid, SunLight(to_vec3("direction", direction)), occluders, {samples, threads, clearance}, progress,
        {.irradiance = view(irradiance, grid), .direction = {}});
    return irradiance;
}

py::tuple point_beams(const Numbers& origin, const Numbers& x_axis, const Numbers& y_axis, const Numbers& normal,
                      double pitch_x, double pitch_y, py::ssize_t width, py::ssize_t height, const Numbers& position,
                      const Occluders* occluders, int samples, int threads, const py::object& progress,
                      double clearance)
{
    const ReceiverGrid grid = to_grid(origin, x_axis, y_axis, normal, pitch_x, pitch_y, width, height);
    return beams_with_direction(grid, PointLight(to_vec3("position", position)), occluders,
                                {samples, threads, clearance}, progress);
}

py::tuple spot_beams(const Numbers& origin, const Numbers& x_axis, const Numbers& y_axis, const Numbers& normal,
                     double pitch_x, double pitch_y, py::ssize_t width, py::ssize_t height, const Numbers& position,
                     const Numbers& frame, double spot_size, double blend, const Occluders* occluders, int samples,
                     int threads, const py::object& progress, const std::string& falloff, double clearance)
{
    const ReceiverGrid grid = to_grid(origin, x_axis, y_axis, normal, pitch_x, pitch_y, width, height);
    const SpotLight light(to_vec3("position", position), to_axes("frame", frame), spot_size, blend,
                          to_falloff(falloff));
    return beams_with_direction(grid, light, occluders, {samples, threads, clearance}, progress);
}

Array<float> coverage(const py::array& corners, const py::array& corner_counts, py::ssize_t width, py::ssize_t height,
                      int threads)
{
    const auto positions = to_rows<double>("corners", corners, 2, "contiguous float64 (N, 2)");
    if (!py::isinstance<Array<std::uint32_t>>(corner_counts) || corner_counts.ndim() != 1)
        reject("corner_counts", shape_text(corner_counts), "contiguous uint32 (P,)");
    if (width < 1 || height < 1)
        reject(width < 1 ? "width" : "height", static_cast<double>(std::min(width, height)), "1 or more texels");
    static_assert(sizeof(Vec2) == 2 * sizeof(double));
    const std::span<const Vec2> points(reinterpret_cast<const Vec2*>(positions.data()), positions.size() / 2);
    const std::span<const std::uint32_t> counts(static_cast<const std::uint32_t*>(corner_counts.data()),
                                                static_cast<std::size_t>(corner_counts.size()));
    Array<float> covered({height, width});
    const View2D<float> texels{covered.mutable_data(), static_cast<std::size_t>(height),
                               static_cast<std::size_t>(width), width};
    {
        const py::gil_scoped_release released;
        compute_coverage(points, counts, threads, texels);
    }
    return covered;
}

std::unique_ptr<Occluders> make_occluders(const py::array& vertices, const py::array& triangles)
{
    const auto positions = to_rows<float>("vertices", vertices, 3, "contiguous float32 (N, 3)");
    const auto indices = to_rows<std::uint32_t>("triangles", triangles, 3, "contiguous uint32 (M, 3)");
    const py::gil_scoped_release released;
    return std::make_unique<Occluders>(positions, indices);
}

// Pieces of the docstrings of the three kinds of beams.
constexpr const char* doc_grid = R"(

Parameters
----------
origin : 3 floats
    World position, in metres, of the outer corner of texel (0, 0).
x_axis, y_axis, normal : 3 floats each
    Unit vectors at right angles in the world: along a row of texels, from row to row, and out of the lit side. They may
    be left-handed (a mirrored texture).
pitch_x, pitch_y : float
    Size of a texel in metres.
width, height : int
    Texels, 1 to 65536.
)";

constexpr const char* doc_settings = R"(
occluders : Occluders, optional
    What casts shadows; None: nothing does.
samples : int
    samples x samples points in each texel, each with its own visibility; 1 to 64.
threads : int
    0: all. The result is the same, bit for bit, for any number.
progress : callable, optional
    progress(fraction) returns False to stop.
clearance : float
    How far off the plane shadow rays start, in metres, besides what rounding needs: as far as the receiver's own faces,
    where they are among the occluders, depart from the plane.
)";

constexpr const char* doc_raises = R"(
Raises
------
ValueError
    An argument is out of range; the message names it.
Cancelled
    `progress` returned False.
)";

constexpr const char* doc_lamp_returns = R"(
Returns
-------
irradiance : ndarray, float32, shape (height, width)
    W/m^2 for a lamp of 1 W: cosine and visible part included. Row 0 is the lowest row of the plane.
direction : ndarray, float32, shape (height, width, 3)
    Unit vectors of travel in the plane frame (x_axis, y_axis, normal), z < 0. Where no light arrives: that of the
    unblocked light, or (0, 0, -1) if the lamp is behind the plane.
)";

}  // namespace

void bind_scene(py::module_& m)
{
    py::class_<Occluders>(m, "Occluders", R"(Triangles that block light, both sides of them.

Parameters
----------
vertices : ndarray, float32, shape (N, 3), C-contiguous
    World positions in metres. Copied.
triangles : ndarray, uint32, shape (M, 3), C-contiguous
    Vertex indices. Copied. M = 0 is allowed: nothing is blocked.

Raises
------
ValueError
    Wrong dtype or shape, a position that is not finite, an index that is out of range.
)")
        .def(py::init(&make_occluders), py::arg("vertices"), py::arg("triangles"))
        .def_property_readonly("triangle_count", &Occluders::triangle_count, "int: number of triangles.");

    m.def("embree_version", &embree_version,
          "The version of Embree in use, 31305 for 3.13.5: not that of the host process.");

    const std::string sun_doc = std::string("Irradiance of a plane by parallel light of 1 W/m^2 at normal incidence.") +
                                doc_grid +
                                R"(direction : 3 floats
    Direction of travel in the world, any length but 0.)" +
                                doc_settings + R"(
Returns
-------
irradiance : ndarray, float32, shape (height, width)
    W/m^2: cosine times visible part of the texel; 0 everywhere if the light comes from behind. Row 0 is the lowest row.
)" + doc_raises;
    m.def("sun_beams", &sun_beams, py::arg("origin"), py::arg("x_axis"), py::arg("y_axis"), py::arg("normal"),
          py::arg("pitch_x"), py::arg("pitch_y"), py::arg("width"), py::arg("height"), py::arg("direction"),
          py::arg("occluders") = py::none(), py::arg("samples") = 4, py::arg("threads") = 0,
          py::arg("progress") = py::none(), py::arg("clearance") = 0.0, sun_doc.c_str());

    const std::string point_doc =
        std::string("Irradiance of a plane by a point lamp of 1 W, and where it comes from.") + doc_grid +
        "position : 3 floats\n    Of the lamp in the world, metres." + doc_settings + doc_lamp_returns + doc_raises;
    m.def("point_beams", &point_beams, py::arg("origin"), py::arg("x_axis"), py::arg("y_axis"), py::arg("normal"),
          py::arg("pitch_x"), py::arg("pitch_y"), py::arg("width"), py::arg("height"), py::arg("position"),
          py::arg("occluders") = py::none(), py::arg("samples") = 4, py::arg("threads") = 0,
          py::arg("progress") = py::none(), py::arg("clearance") = 0.0, point_doc.c_str());

    const std::string spot_doc =
        std::string(
            "Irradiance of a plane by a spot lamp of 1 W (over the whole sphere, as Blender counts it), and "
            "where it comes from.") +
        doc_grid + R"(position : 3 floats
    Of the lamp in the world, metres.
frame : (3, 3) floats
    Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
    along -z.
spot_size : float
    Full angle of the cone in radians, 0 < spot_size <= pi.
blend : float
    Soft part of the cone, 0 to 1.)" +
        doc_settings + R"(falloff : str
    "scaled": as Cycles in Blender 4.2, 4.5 and 5.0, where the lamp's scale shapes the cone. "legacy": as in 3.4, where
    it does not, and light falls off with the cosine to the axis besides.
)" + doc_lamp_returns +
        doc_raises;
    m.def("spot_beams", &spot_beams, py::arg("origin"), py::arg("x_axis"), py::arg("y_axis"), py::arg("normal"),
          py::arg("pitch_x"), py::arg("pitch_y"), py::arg("width"), py::arg("height"), py::arg("position"),
          py::arg("frame"), py::arg("spot_size"), py::arg("blend"), py::arg("occluders") = py::none(),
          py::arg("samples") = 4, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("falloff") = "scaled", py::arg("clearance") = 0.0, spot_doc.c_str());

    m.def("coverage", &coverage, py::arg("corners"), py::arg("corner_counts"), py::arg("width"), py::arg("height"),
          py::arg("threads") = 0, R"(The exact part of each texel of a grid that polygons cover.

Parameters
----------
corners : ndarray, float64, shape (N, 2), C-contiguous
    The corners of all polygons, one after the other, in texels: texel (row y, column x) spans [x, x+1] x [y, y+1].
    Polygons may be concave, have either orientation and reach beyond the grid.
corner_counts : ndarray, uint32, shape (P,), C-contiguous
    How many corners each polygon has: 3 or more; all 3 for triangles.
width, height : int
    Of the grid in texels.
threads : int
    0: all.

Returns
-------
coverage : ndarray, float32, shape (height, width)
    0 to 1; where polygons overlap the sum is cut at 1.

Raises
------
ValueError
    An argument is out of range; the message names it.
)");
}

}  // namespace beamspread
