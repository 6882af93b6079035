// Python names of native/solve: PlaneLight, convolve, adaptive_beams.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/error.h"
#include "python/media.h"
#include "solve/adaptive/adaptive.h"
#include "solve/solve.h"

namespace beamspread {

namespace {

// Arrays of any strides: a channel is viewed in place.
using Plane2D = py::array_t<float, 0>;

View2D<const float> channel_view(const Plane2D& irradiance, py::ssize_t channel)
{
    const auto stride = [&](py::ssize_t axis) {
        return irradiance.strides(axis) / static_cast<py::ssize_t>(sizeof(float));
    };
    const py::ssize_t first = irradiance.ndim() == 3 ? channel * stride(2) : 0;
    return {irradiance.data() + first, side(irradiance, 0), side(irradiance, 1), stride(0), stride(1)};
}

Directions directions_of(const Array<float>& direction, const View2D<const float>& irradiance)
{
    if (direction.ndim() == 1 && direction.shape(0) == 3)
        return OneDirection{Vec3(direction.at(0), direction.at(1), direction.at(2))};
    if (direction.ndim() == 3 && side(direction, 0) == irradiance.height && side(direction, 1) == irradiance.width &&
        direction.shape(2) == 3)
        return PerTexel{direction.data()};
    reject("direction", shape_text(direction), "(3,) or (H, W, 3) like irradiance");
}

HeldLight light_of(const Plane2D& irradiance, const Array<float>& direction, const std::vector<double>& color)
{
    if (irradiance.ndim() != 2)
        reject("irradiance", shape_text(irradiance), "(H, W)");
    const View2D<const float> view = channel_view(irradiance, 0);
    return {{view, directions_of(direction, view), color}, {irradiance, direction}};
}

std::vector<HeldLight> lights_of(const Plane2D& irradiance, const Array<float>& direction, std::size_t channels)
{
    const bool apart = irradiance.ndim() == 3 && side(irradiance, 2) == channels;
    if (irradiance.ndim() != 2 && !apart)
        reject("irradiance", shape_text(irradiance), "(H, W) or (H, W, channels)");
    std::vector<View2D<const float>> views;
    for (std::size_t c = 0; c < (apart ? channels : 1); ++c)
        views.push_back(channel_view(irradiance, static_cast<py::ssize_t>(c)));
    std::vector<HeldLight> held;
    for (PlaneLight& light : lights_of_channels(views, directions_of(direction, views.front()))) {
        light.color.resize(channels, 1.0);
        held.push_back({std::move(light), {irradiance, direction}});
    }
    return held;
}

const float* entering_of(const Array<float>& factors, const Problem& problem)
{
    if (factors.ndim() != 3 || side(factors, 0) != problem.plane.height || side(factors, 1) != problem.plane.width ||
        side(factors, 2) != problem.channels.size())
        reject("entering", shape_text(factors), "(H, W, C) like the luminance");
    return factors.data();
}

Array<float> convolve(const Lights& lights, const Sources& ldf, const std::vector<double>& albedo,
                      const std::vector<double>& mean_free_path, std::array<double, 2> pitch, const std::string& solver,
                      double tolerance, int threads, const py::object& progress, std::size_t memory,
                      std::size_t coarsening, const std::string& side,
                      const std::vector<std::array<std::size_t, 4>>& parts, const std::optional<Array<float>>& entering)
{
    Problem problem = problem_of(lights, ldf, albedo, mean_free_path, pitch, tolerance, side);
    for (const auto& [y, x, height, width] : parts) {
        if (y + height > problem.plane.height || x + width > problem.plane.width || height * width == 0)
            reject("parts", "a part beyond the plane", "rectangles of texels of the plane");
        problem.plane.parts.push_back({y, x, height, width});
        problem.plane.extent = std::max(problem.plane.extent, std::hypot(static_cast<double>(width) * pitch[0],
                                                                         static_cast<double>(height) * pitch[1]));
    }
    problem.solver = named_solver(solver);
    problem.threads = threads;
    problem.memory = memory;
    problem.coarsening = coarsening;
    if (entering)
        problem.entering = entering_of(*entering, problem);
    Progress report(progress_callback(progress));
    Array<float> luminance({problem.plane.height, problem.plane.width, problem.channels.size()});
    float* data = luminance.mutable_data();
    const py::gil_scoped_release release;
    solve(problem, report, data);
    return luminance;
}

using Squares = std::tuple<Array<std::int64_t>, Array<double>>;

Squares adaptive_beams(const HeldLight& light, double tolerance)
{
    const View2D<const float>& irradiance = light.light.irradiance;
    const Plane plane{irradiance.width, irradiance.height};
    std::vector<Square> squares;
    {
        const py::gil_scoped_release release;
        validate(Problem{
            plane, std::vector<ChannelMedium>(light.light.color.size()), {light.light}, Solver::adaptive, tolerance});
        squares = beam_squares(plane, light.light, tolerance);
    }
    const auto count = static_cast<py::ssize_t>(squares.size());
    Array<std::int64_t> places({count, py::ssize_t{3}});
    Array<double> power(count);
    std::int64_t* place = places.mutable_data();
    double* mean = power.mutable_data();
    for (const Square& square : squares) {
        *place++ = static_cast<std::int64_t>(square.y);
        *place++ = static_cast<std::int64_t>(square.x);
        *place++ = static_cast<std::int64_t>(square.size);
        *mean++ = square.irradiance;
    }
    return {places, power};
}

}  // namespace

void bind_solve(py::module_& m)
{
    py::class_<HeldLight>(m, "PlaneLight", R"(Light of one lamp on a plane.

Parameters
----------
irradiance : ndarray, float32, shape (H, W)
    W/m^2 where the colour is 1, cosine and visibility included; not copied.
direction : ndarray, float32, shape (3,) or (H, W, 3)
    Unit vectors of travel in the plane frame, z < 0: one for all texels, or one for each; not copied.
color : sequence of float
    Factor of the irradiance in each channel.
)")
        .def(py::init(&light_of), py::arg("irradiance"), py::arg("direction"), py::arg("color"))
        .def_static("of_channels", &lights_of, py::arg("irradiance"), py::arg("direction"), py::arg("channels"),
                    "Lights for irradiance (H, W) or (H, W, channels): one where channels differ by a factor, else one "
                    "for each.");
    m.def("convolve", &convolve, py::arg("lights"), py::arg("ldf"), py::arg("albedo"), py::arg("mean_free_path"),
          py::arg("pitch"), py::arg("solver"), py::arg("tolerance"), py::arg("threads"), py::arg("progress"),
          py::arg("memory") = Problem().memory, py::arg("coarsening") = Problem().coarsening,
          py::arg("side") = "reflected", py::arg("parts") = std::vector<std::array<std::size_t, 4>>(),
          py::arg("entering") = py::none(),
          R"(Luminance of lights on a grid; the engine behind `beamspread.convolve`.

C libraries, albedos and mean free paths (metres), pitch (x, y) in metres; returns float32 (H, W, C) in W/(m^2 sr).
`memory`: bytes that the spectra of the solver 'fft' may take; where the whole plane needs more it is solved in tiles.
`coarsening`: texels from node to node of the grid on which it spreads light far: 4, 8, 16, ... 64, 1 for no such grid,
0 for what costs least.
`side`: of the luminance, 'reflected' where light enters or 'transmitted' at the same texels of a slab's far side.
`parts`: (row, column, height, width) of each part of a divided plane, on which the solver 'fft' keeps light.
`entering`: float32 (H, W, C), factors by which all light enters, for the solver 'fft'; None: 1.
)");
    m.def("adaptive_beams", &adaptive_beams, py::arg("light"), py::arg("tolerance"),
          R"(Squares that the adaptive solver lights by one beam each; the engine behind `beamspread.adaptive_beams`.

Returns int64 (N, 3) of row, column and size, and float64 (N,) mean irradiance.
)");
}

}  // namespace beamspread
