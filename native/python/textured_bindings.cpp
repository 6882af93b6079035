// Python names of native/solve/textured.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/error.h"
#include "python/casters.h"
#include "solve/textured/textured.h"

namespace beamspread {

namespace {

View2D<const float> map_view(const std::string& name, const Array<float>& map)
{
    if (map.ndim() != 2)
        reject(name, shape_text(map), "(H, W)");
    return {map.data(), side(map, 0), side(map, 1), map.shape(1)};
}

py::tuple textured(const Medium& medium, std::array<double, 2> texels_per_path, const Array<float>& albedo,
                   const Array<float>& factor, double mean_albedo, const Array<float>& convention,
                   const std::vector<std::pair<Array<float>, Numbers>>& lights, const std::string& side_name,
                   double tolerance, std::size_t max_walks, std::uint64_t seed, int threads, const py::object& callback)
{
    TexturedProblem problem{medium,
                            texels_per_path,
                            map_view("albedo", albedo),
                            map_view("factor", factor),
                            mean_albedo,
                            map_view("convention", convention),
                            {}};
    for (const auto& [irradiance, travel] : lights)
        problem.lights.push_back({map_view("irradiance", irradiance), to_vec3("travel", travel)});
    problem.is_through = side_from_name(side_name) == Side::transmitted;
    if (problem.is_through && medium.is_half_space())
        reject("side", "'transmitted'", "'reflected' on half-spaces");
    problem.tolerance = tolerance;
    problem.max_walks = max_walks;
    problem.seed = seed;
    problem.threads = threads;
    Progress progress(progress_callback(callback));
    Array<float> luminance({problem.albedo.height, problem.albedo.width});
    float* const data = luminance.mutable_data();
    TexturedError error;
    {
        const py::gil_scoped_release release;
        error = solve_textured(problem, progress, data, 1);
    }
    return py::make_tuple(luminance, error.error, error.walks);
}

}  // namespace

void bind_textured(py::module_& m)
{
    m.def("textured", &textured, py::arg("medium"), py::arg("texels_per_path"), py::arg("albedo"), py::arg("factor"),
          py::arg("mean_albedo"), py::arg("convention"), py::arg("lights"), py::arg("side"), py::arg("tolerance"),
          py::arg("max_walks"), py::arg("seed") = 0, py::arg("threads") = 0, py::arg("progress") = py::none(),
          R"(Luminance of a plane whose albedo differs from texel to texel, one channel.

Parameters
----------
medium : Medium
texels_per_path : (float, float)
    A mean free path in texels, along x and y.
albedo : ndarray, float32, shape (H, W)
    Single-scattering albedo of each texel, in [0, 1). It goes straight down, and on beyond the border.
factor : ndarray, float32, shape (H, W)
    What the convention multiplies light by where it enters and where it leaves, above 0.
mean_albedo : float
    Albedo of the convention's medium.
convention : ndarray, float32, shape (H, W)
    Luminance by the convention, W/(m^2 sr).
lights : sequence of (irradiance, travel)
    Irradiance (H, W), float32, W/m^2, and the unit vector along which it travels in the plane's frame, z < 0.
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

Returns
-------
luminance : ndarray, float32, shape (H, W)
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
