#include <algorithm>

#include "ldf/library/library.h"
#include "python/casters.h"
#include "transport/exact/adding_doubling.h"

namespace beamspread {

namespace {

py::tuple exact(const Medium& medium, const std::vector<double>& angles, const std::vector<double>& albedos,
                int threads)
{
    ExactTotals totals;
    {
        const py::gil_scoped_release release;
        totals = exact_totals(medium, angles, albedos, threads);
    }
    const auto table = [&](const std::vector<double>& values) {
        Array<double> array({angles.size(), albedos.size()});
        std::copy(values.begin(), values.end(), array.mutable_data());
        return array;
    };
    return py::make_tuple(table(totals.reflectance), table(totals.transmittance));
}

}  // namespace

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
    Called with the finished fraction. The answer False (or NumPy's) stops, any other goes on; an error passes through.
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
    m.def("exact_totals", &exact, py::arg("medium"), py::arg("angles"), py::arg("albedos"), py::arg("threads") = 0,
          R"(Reflectance and transmittance of a medium without noise, by discrete ordinates and doubling of layers.

The plane-parallel problem alone, as van de Hulst 1980 and Prahl, van Gemert, Welch 1993 (Appl. Opt. 32, 559) solve it:
it knows nothing of where light leaves, and so checks simulations and calibrates libraries. Twice as many
directions change the results by less than 1e-4 of each for -.95 <= g <= .95 and angles up to 88 degrees.

Parameters
----------
medium : Medium
angles : sequence of float
    Angles of incidence, degrees from the surface normal, 0 <= angle < 90.
albedos : sequence of float
    Single-scattering albedos, 0 <= albedo < 1.
threads : int
    0: all. The result does not depend on it.

Returns
-------
reflectance, transmittance : float64, shape (angles, albedos)
    Power per unit incident power: what `LdfLibrary.reflectance` and `LdfLibrary.transmittance` estimate.

Raises
------
ValueError
    Names the argument, its value and what is allowed.
)");
}

}  // namespace beamspread
