#include <array>
#include <cstdint>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "base/error.h"
#include "python/casters.h"
#include "solve/adaptive/mask_pyramid.h"
#include "solve/problem/problem.h"

namespace beamspread {

namespace {

std::string shape_text(const py::array& array)
{
    return "of shape " + py::str(array.attr("shape")).cast<std::string>();
}

Problem grid_problem(const Array<float>& irradiance, std::size_t channels)
{
    const py::ssize_t rank = irradiance.ndim();
    if (rank != 2 && !(rank == 3 && irradiance.shape(2) == static_cast<py::ssize_t>(channels)))
        reject("irradiance", shape_text(irradiance), "(H, W) or (H, W, channels)");
    Problem problem;
    problem.height = static_cast<std::size_t>(irradiance.shape(0));
    problem.width = static_cast<std::size_t>(irradiance.shape(1));
    problem.channels.resize(channels);
    const std::size_t stride = rank == 3 ? channels : 1;
    for (std::size_t c = 0; c < channels; ++c)
        problem.channels[c].irradiance = {irradiance.data() + (rank == 3 ? c : 0), problem.height, problem.width,
                                          static_cast<std::ptrdiff_t>(stride * problem.width),
                                          static_cast<std::ptrdiff_t>(stride)};
    return problem;
}

Array<float> interleaved(const Luminance& luminance, std::size_t height, std::size_t width)
{
    const std::size_t channels = luminance.size();
    Array<float> result({height, width, channels});
    float* out = result.mutable_data();
    for (std::size_t c = 0; c < channels; ++c)
        for (std::size_t i = 0; i < luminance[c].size(); ++i)
            out[i * channels + c] = luminance[c][i];
    return result;
}

void set_directions(Problem& problem, const Array<float>& direction)
{
    const auto height = static_cast<py::ssize_t>(problem.height);
    const auto width = static_cast<py::ssize_t>(problem.width);
    if (direction.ndim() == 1 && direction.shape(0) == 3)
        problem.directions.uniform = Vec3(direction.at(0), direction.at(1), direction.at(2));
    else if (direction.ndim() == 3 && direction.shape(0) == height && direction.shape(1) == width &&
             direction.shape(2) == 3)
        problem.directions.field = direction.data();
    else
        reject("direction", shape_text(direction), "(3,) or (H, W, 3) like irradiance");
}

using Light = std::pair<Array<float>, Array<float>>;  // irradiance and direction

Array<float> convolve(const std::vector<Light>& lights, const std::vector<std::shared_ptr<LdfSource>>& ldf,
                      const std::vector<double>& albedo, const std::vector<double>& mean_free_path,
                      std::array<double, 2> pitch, const std::string& solver, double tolerance, int threads,
                      const py::object& progress, std::size_t memory, std::size_t coarsening)
{
    const std::size_t channels = albedo.size();
    if (ldf.size() != channels || mean_free_path.size() != channels)
        reject("ldf", "of another number of channels than albedo", "one per channel");
    if (lights.empty())
        reject("lights", "empty", "at least one light");
    std::vector<Problem> problems;
    for (const auto& [irradiance, direction] : lights) {
        Problem& problem = problems.emplace_back(grid_problem(irradiance, channels));
        if (problem.height != problems.front().height || problem.width != problems.front().width)
            reject("irradiance", shape_text(irradiance), "the same shape for all lights");
        set_directions(problem, direction);
        problem.pitch_x = pitch[0];
        problem.pitch_y = pitch[1];
        problem.tolerance = tolerance;
        problem.threads = threads;
        problem.memory = memory;
        problem.coarsening = coarsening;
        for (std::size_t c = 0; c < channels; ++c) {
            problem.channels[c].library = ldf[c].get();
            problem.channels[c].albedo = albedo[c];
            problem.channels[c].mean_free_path = mean_free_path[c];
        }
    }
    const Problem& first = problems.front();
    Progress report(progress_callback(progress));
    if (solver == "fft") {
        Array<float> luminance({first.height, first.width, channels});
        float* data = luminance.mutable_data();
        const py::gil_scoped_release release;
        solve_fft(problems, report, data);
        add_unscattered(problems, data);
        return luminance;
    }
    if (solver != "direct" && solver != "adaptive")
        reject("solver", "'" + solver + "'", "'fft', 'direct', 'adaptive'");
    if (problems.size() > 1)
        reject("lights", static_cast<double>(problems.size()), "one, except for the solver 'fft'");
    Luminance planes;
    {
        const py::gil_scoped_release release;
        planes = solver == "direct" ? solve_direct(first, report) : solve_adaptive(first, report);
    }
    Array<float> luminance = interleaved(planes, first.height, first.width);
    float* data = luminance.mutable_data();
    const py::gil_scoped_release release;
    add_unscattered(problems, data);
    return luminance;
}

using Squares = std::tuple<Array<std::int64_t>, Array<double>>;

Squares adaptive_beams(const Array<float>& irradiance, const Array<float>& direction, double tolerance)
{
    Problem problem = grid_problem(irradiance, 1);
    problem.tolerance = tolerance;
    set_directions(problem, direction);
    std::vector<Square> squares;
    {
        const py::gil_scoped_release release;
        validate(problem);
        squares = even_squares(problem, problem.channels[0].irradiance);
    }
    const auto count = static_cast<py::ssize_t>(squares.size());
    Array<std::int64_t> places({count, py::ssize_t{3}});
    Array<double> light(count);
    std::int64_t* place = places.mutable_data();
    double* mean = light.mutable_data();
    for (const Square& square : squares) {
        *place++ = static_cast<std::int64_t>(square.y);
        *place++ = static_cast<std::int64_t>(square.x);
        *place++ = static_cast<std::int64_t>(square.size);
        *mean++ = square.irradiance;
    }
    return {places, light};
}

}  // namespace

void bind_solve(py::module_& m)
{
    m.def("convolve", &convolve, py::arg("lights"), py::arg("ldf"), py::arg("albedo"), py::arg("mean_free_path"),
          py::arg("pitch"), py::arg("solver"), py::arg("tolerance"), py::arg("threads"), py::arg("progress"),
          py::arg("memory") = Problem().memory, py::arg("coarsening") = Problem().coarsening,
          R"(Luminance of beams on a grid; the engine behind `beamspread.convolve`.

Lights are pairs of irradiance, float32 (H, W) or (H, W, C) in W/m^2, and direction, float32 (3,) or (H, W, 3); C
libraries, albedos and mean free paths (metres), pitch (x, y) in metres; returns float32 (H, W, C) in W/(m^2 sr).
`memory`: bytes that the spectra of the solver 'fft' may take; where the whole plane needs more it is solved in tiles.
`coarsening`: texels from node to node of the grid on which it spreads light far: 4, 8, 16, ... 64, 1 for no such grid,
0 for what costs least.
)");
    m.def("adaptive_beams", &adaptive_beams, py::arg("irradiance"), py::arg("direction"), py::arg("tolerance"),
          R"(Squares that the adaptive solver lights by one beam each; the engine behind `beamspread.adaptive_beams`.

irradiance float32 (H, W), direction float32 (3,) or (H, W, 3); returns int64 (N, 3) of row, column and size, and
float64 (N,) mean irradiance.
)");
}

}  // namespace beamspread
