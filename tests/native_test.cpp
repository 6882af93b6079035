// The module _native_test: functions of the engine that tests and measurements call and the package does not. It lies
// beside the staged package, never inside.
#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "base/circle.h"
#include "base/sobol.h"
#include "fft/fft.h"
#include "medium/medium.h"
#include "python/media.h"
#include "scene/light.h"
#include "scene/occluders.h"
#include "solve/solve.h"
#include "solve/spectral/light_field.h"

namespace beamspread {

void bind_surface(py::module_& m);

namespace {

// Number of lines, and of values in each.
std::pair<std::size_t, std::size_t> lines_of(const std::string& name, const py::array& array)
{
    if (array.ndim() != 2 || array.shape(0) == 0 || array.shape(1) == 0)
        reject(name, shape_text(array), "(lines, values), not empty");
    return {side(array, 0), side(array, 1)};
}

Array<Complex> real_transform(const Array<float>& values, int threads, const std::string& instruction_set)
{
    const auto [height, width] = lines_of("values", values);
    if (width % 2 != 0)
        reject("values", std::to_string(width) + " columns", "an even number of columns");
    const FftInstructionSet& instructions = fft_instruction_set(instruction_set);
    Array<Complex> spectrum({height, width / 2 + 1});
    Complex* out = spectrum.mutable_data();
    const float* in = values.data();
    const py::gil_scoped_release release;
    real_to_half_2d(instructions, in, out, height, width, threads);
    return spectrum;
}

Array<double> sobol_points(std::size_t side, std::size_t points_per_cell, std::size_t count)
{
    const GridSobol sobol(points_per_cell, 0);
    Array<double> points({side * side, count, GridSobol::dimensions});
    std::vector<Vec2> front(count), back(count);
    double* out = points.mutable_data();
    for (std::size_t y = 0; y < side; ++y)
        for (std::size_t x = 0; x < side; ++x) {
            sobol.points(x, y, 0, count, front.data(), back.data());
            for (std::size_t i = 0; i < count; ++i)
                for (const double value : {front[i].x, front[i].y, back[i].x, back[i].y})
                    *out++ = value;
        }
    return points;
}

Array<Complex> real_lines(const Array<float>& values, const std::string& instruction_set)
{
    const auto [count, size] = lines_of("values", values);
    Array<Complex> half({count, size / 2 + 1});
    fft_instruction_set(instruction_set).real_to_half(values.data(), half.mutable_data(), count, size);
    return half;
}

Array<float> half_lines(const Array<Complex>& half, std::size_t size, const std::string& instruction_set)
{
    const auto [count, frequencies] = lines_of("half", half);
    if (size / 2 + 1 != frequencies)
        reject("size", static_cast<double>(size), "one whose half has as many frequencies as the lines");
    Array<float> values({count, size});
    fft_instruction_set(instruction_set).half_to_real(half.data(), values.mutable_data(), count, size);
    return values;
}

Array<Complex> complex_lines(const Array<Complex>& values, bool forward, const std::string& instruction_set)
{
    const auto [count, size] = lines_of("values", values);
    Array<Complex> result({count, size});
    std::copy_n(values.data(), count * size, result.mutable_data());
    fft_instruction_set(instruction_set).complex_in_place(result.mutable_data(), count, size, forward);
    return result;
}

py::tuple irradiance(const Light& light, const Numbers& point, const Numbers& normal)
{
    const Vec3 arriving = light.irradiance(to_vec3("point", point), to_vec3("normal", normal));
    return py::make_tuple(arriving.x, arriving.y, arriving.z);
}

py::tuple sample(const Light& light, const Numbers& point, const Numbers& normal, const py::array& square)
{
    const auto positions = to_rows<Vec2, double>("square", square, "contiguous float64 (N, 2)");
    const std::vector<Vec3> points(positions.size(), to_vec3("point", point));
    std::vector<LightRay> rays(positions.size());
    light.sample(points, to_vec3("normal", normal), positions, rays.data());
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

HeldLight light_from_point(const Array<float>& irradiance, std::array<double, 3> position,
                           const std::vector<double>& color)
{
    if (irradiance.ndim() != 2)
        reject("irradiance", shape_text(irradiance), "(H, W)");
    const View2D<const float> view{irradiance.data(), side(irradiance, 0), side(irradiance, 1), irradiance.shape(1)};
    return {{view, FromPoint{Vec3(position[0], position[1], position[2])}, color}, {irradiance}};
}

std::size_t transforms(const Lights& lights, const Sources& ldf, const std::vector<double>& albedo,
                       const std::vector<double>& mean_free_path, std::array<double, 2> pitch, double tolerance)
{
    Problem problem = problem_of(lights, ldf, albedo, mean_free_path, pitch, tolerance);
    Progress unseen;
    const py::gil_scoped_release release;
    return LightField(problem, unseen).terms();
}

}  // namespace

}  // namespace beamspread

PYBIND11_MODULE(_native_test, m)
{
    using namespace beamspread;
    m.doc() = "Functions of beamspread's engine for tests.";
    py::module_::import("beamspread");  // has the types of the arguments
    py::register_local_exception_translator([](std::exception_ptr pointer) {
        try {
            std::rethrow_exception(pointer);
        } catch (const InvalidArgument& error) {
            PyErr_SetString(PyExc_ValueError, error.what());
        }
    });

    m.def("fft_instruction_sets", &fft_instruction_sets,
          R"(Instruction sets of the transforms that this processor can run, fastest first; the solver uses the first.

A subset of "avx512", "avx2" and "baseline". An empty `instruction_set` of the functions below means the fastest.
)");
    m.def("fast_size", &fast_even_size, py::arg("min_size"), "The smallest even size of fast transforms.");
    m.def("real_transform", &real_transform, py::arg("values"), py::arg("threads") = 0, py::arg("instruction_set") = "",
          "Fourier transform of real values, float32 (H, W) with W even; complex64 (H, W / 2 + 1).");
    m.def("real_lines", &real_lines, py::arg("values"), py::arg("instruction_set") = "",
          "Transforms of lines of real values: float32 (N, size) to complex64 (N, size // 2 + 1).");
    m.def("half_lines", &half_lines, py::arg("half"), py::arg("size"), py::arg("instruction_set") = "",
          "Inverse of `real_lines` but for a factor: complex64 (N, size // 2 + 1) to `size` times float32 (N, size).");
    m.def("complex_lines", &complex_lines, py::arg("values"), py::arg("forward"), py::arg("instruction_set") = "",
          "Transforms of lines of complex values, complex64 (N, size), by e^-i, or backward by e^i; both are plain "
          "sums.");

    m.def("on_circle", py::vectorize([](double turn) { return on_circle(turn).x; }), py::arg("turn"), "cos(2 pi turn).");
    m.def("on_circle_up", py::vectorize([](double turn) { return on_circle(turn).y; }), py::arg("turn"),
          "sin(2 pi turn).");
    m.def("sobol_points", &sobol_points, py::arg("side"), py::arg("points_per_cell"), py::arg("count"),
          "The first points of each cell of a square grid: float64 (side * side, count, 4).");

    m.def("henyey_greenstein_pdf", py::vectorize(&henyey_greenstein_pdf), py::arg("cos_theta"), py::arg("g"),
          "Density per steradian of a deflection.");
    m.def("henyey_greenstein_sample", py::vectorize(&henyey_greenstein_sample), py::arg("g"), py::arg("u"),
          "Cosine of a deflection, from u uniform in [0, 1).");

    m.def(
        "is_delta", [](const Light& light) { return light.is_delta(); }, py::arg("light"),
        "True if a light has no size, so that one ray reaches each point.");
    m.def("irradiance", &irradiance, py::arg("light"), py::arg("point"), py::arg("normal"),
          R"(Irradiance by a light at a point where nothing blocks it, W/m^2 in each of 3 channels.

`point`: world position, metres; `normal`: unit vector out of the lit side of the plane there.
)");
    m.def("sample", &sample, py::arg("light"), py::arg("point"), py::arg("normal"), py::arg("square"),
          R"(Rays from a point toward a light.

Parameters
----------
light, point, normal
    As for `irradiance`.
square : ndarray, float64, shape (N, 2), C-contiguous
    Positions in the unit square, evenly spread for the density of rays that `flux` assumes.

Returns
-------
travel : ndarray, float64, shape (N, 3)
    Unit vectors along which the light travels, world.
distance : ndarray, float64, shape (N,)
    Distance to the light, metres.
flux : ndarray, float32, shape (N, 3)
    W/m^2 on a surface that faces the ray, over the density of rays: the mean of flux times cosine to the normal is the
    irradiance.
)");
    m.def(
        "instance_count", [](const Occluders& occluders) { return occluders.hulls().size(); }, py::arg("occluders"),
        "Number of placements that share their mesh's triangles.");

    m.def("light_from_point", &light_from_point, py::arg("irradiance"), py::arg("position"), py::arg("color"),
          "PlaneLight from one position: x, y, z > 0 in metres from the outer corner of texel (0, 0).");
    m.def("transforms", &transforms, py::arg("lights"), py::arg("ldf"), py::arg("albedo"), py::arg("mean_free_path"),
          py::arg("pitch"), py::arg("tolerance"),
          "Number of transforms of light that the solver 'fft' makes for `convolve`.");
    bind_surface(m);
}
