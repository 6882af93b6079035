// Python names of native/solve/textured.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "python/casters.h"
#include "solve/textured/textured.h"

namespace beamspread {

namespace {

View2D<const float> map_view(const std::string& name, const Array<float>& map, int channel)
{
    if (map.ndim() == 2)
        return {map.data(), side(map, 0), side(map, 1), map.shape(1)};
    if (map.ndim() != 3)
        reject(name, shape_text(map), "(H, W) or (H, W, C)");
    if (channel < 0 || channel >= map.shape(2))
        reject("channel", std::to_string(channel), "one of '" + name + "'");
    return {map.data() + channel, side(map, 0), side(map, 1), map.shape(1) * map.shape(2), map.shape(2)};
}

py::tuple textured(const Medium& medium, std::array<double, 2> texels_per_path, const Array<float>& albedo,
                   const Array<float>& factor, double mean_albedo, const Array<float>& convention,
                   const std::vector<std::pair<Array<float>, Numbers>>& lights, const std::string& side_name,
                   double tolerance, std::size_t max_walks, std::uint64_t seed, int threads, const py::object& callback,
                   int channel, const std::optional<Array<float>>& coverage, std::optional<Array<float>> result,
                   double max_more)
{
    TexturedProblem problem{medium,
                            texels_per_path,
                            map_view("albedo", albedo, channel),
                            map_view("factor", factor, channel),
                            mean_albedo,
                            map_view("convention", convention, channel),
                            {}};
    for (const auto& [irradiance, travel] : lights)
        problem.lights.push_back({map_view("irradiance", irradiance, channel), to_vec3("travel", travel)});
    if (coverage)
        problem.coverage = map_view("coverage", *coverage, channel);
    problem.is_through = side_from_name(side_name) == Side::transmitted;
    if (problem.is_through && medium.is_half_space())
        reject("side", "'transmitted'", "'reflected' on half-spaces");
    problem.tolerance = tolerance;
    problem.max_walks = max_walks;
    problem.max_more = max_more;
    problem.seed = seed;
    problem.threads = threads;
    Progress progress(progress_callback(callback));
    Array<float> luminance = result ? *result : Array<float>({problem.albedo.height, problem.albedo.width});
    const View2D<const float> written = map_view("result", luminance, channel);
    if (written.height != problem.albedo.height || written.width != problem.albedo.width)
        reject("result", shape_text(luminance), "the height and width of 'albedo'");
    float* const data = luminance.mutable_data() + (written.data - luminance.data());
    TexturedError error;
    {
        const py::gil_scoped_release release;
        error = solve_textured(problem, progress, data, static_cast<std::size_t>(written.column_stride));
    }
    return py::make_tuple(luminance, error.error, error.walks);
}

}  // namespace

void bind_textured(py::module_& m)
{
    m.def("textured", &textured, py::arg("medium"), py::arg("texels_per_path"), py::arg("albedo"), py::arg("factor"),
          py::arg("mean_albedo"), py::arg("convention"), py::arg("lights"), py::arg("side"), py::arg("tolerance"),
          py::arg("max_walks"), py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          py::arg("channel") = 0, py::arg("coverage") = py::none(), py::arg("result").noconvert() = py::none(),
          py::arg("max_more") = 1.0,
          R"(Luminance of a plane whose albedo differs from texel to texel, one channel.

Parameters
----------
medium : Medium
texels_per_path : (float, float)
    A mean free path in texels, along x and y.
albedo : ndarray, float32, shape (H, W) or (H, W, C), as all maps
    Single-scattering albedo of each texel, in [0, 1). It goes straight down, and on beyond the border.
factor : ndarray, float32
    What the convention multiplies light by where it enters and where it leaves, above 0.
mean_albedo : float
    Albedo of the convention's medium.
convention : ndarray, float32
    Luminance by the convention, W/(m^2 sr).
lights : sequence of (irradiance, travel)
    Irradiance, float32, W/m^2, and the unit vector along which it travels in the plane's frame, z < 0. Maps of another
    size show the nearest texels.
side : {"reflected", "transmitted"}
    Face that light leaves: that which it entered, or the far one of a slab.
tolerance : float
    Wanted root mean square error of texels, over the root mean square of the luminance; that of the sum is an eighth.
    It is not reached where it would take too long.
max_walks : int
    Largest number of walks for each texel.
seed : int
threads : int
    0: all. The result is the same, bit for bit, for any number.
progress : callable, optional
    progress(fraction) returns False to stop.
channel : int
    Channel of maps of shape (H, W, C).
coverage : ndarray, float32, optional
    Fraction of each texel that light enters; 1 without it.
result : ndarray, float32, optional
    Takes the luminance, and is returned; it may be `convention`.
max_more : float, optional
    Largest multiple of `max_walks` where lights of the same angle share walks: as many as take the time of one light.

Returns
-------
luminance : ndarray, float32, shape (H, W) unless there is a `result`
error : float
    Estimated, as `tolerance`.
walks : int

Raises
------
ValueError
    An argument is out of range; the message names it.
Cancelled
    `progress` returned False.
)");
}

}  // namespace beamspread
