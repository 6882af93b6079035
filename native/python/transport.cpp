#include "ldf/library.h"
#include "python/casters.h"

namespace beamspread {

void bind_transport(py::module_& m)
{
    m.def(
        "simulate",
        [](const Medium& medium, const std::vector<double>& angles, std::int64_t photons, std::uint64_t seed,
           int threads, const py::object& progress, const std::string& kernel) {
            Progress report(progress_callback(progress));
            const py::gil_scoped_release release;
            return std::make_shared<LdfLibrary>(simulate_library(
                medium, angles, photons < 0 ? 0 : static_cast<std::uint64_t>(photons), seed, threads, kernel, report));
        },
        py::arg("medium"), py::arg("angles"), py::arg("photons"), py::arg("seed") = 1, py::arg("threads") = 0,
        py::arg("progress") = py::none(), py::arg("kernel") = "",
        R"(Simulate the light that beams spread inside a medium, by Monte Carlo.

One simulation serves every albedo, because what leaves is tallied by scattering order.

Parameters
----------
medium : Medium
angles : sequence of float
    Angles of incidence, degrees from the surface normal, 0 <= angle < 90, distinct.
photons : int
    Per angle, at least 1.
seed : int
    The result depends on it, and not on the number of threads.
threads : int
    0: all.
progress : callable, optional
    Called with the finished fraction; returning False stops.
kernel : str
    One of `walk_kernels()`; empty: the fastest. They agree up to the simulation's noise.

Returns
-------
LdfLibrary

Raises
------
ValueError
    Names the argument, its value and what is allowed.
Cancelled
    `progress` returned False.
)");
    m.def(
        "walk_kernels",
        [] {
            std::vector<std::string> names;
            for (const WalkKernel& kernel : walk_kernels())
                names.emplace_back(kernel.name);
            return names;
        },
        R"(Names of the implementations of the photon walk that this processor can run, fastest first.

The last, `scalar`, walks one photon at a time in double precision and is the truth for the others, which
walk as many as a vector has lanes, in single precision.
)");
}

}  // namespace beamspread
