// Python names of media, the simulation and exact totals.
#include <algorithm>
#include <limits>

#include "ldf/library/ldf_library.h"
#include "medium/medium.h"
#include "python/casters.h"
#include "transport/exact/exact_totals.h"

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
    const auto table = [&](std::vector<double>& values) {
        return to_array<double>(std::move(values), {angles.size(), albedos.size()});
    };
    return py::make_tuple(table(totals.reflectance), table(totals.transmittance));
}

std::uint64_t photon_count(std::int64_t photons)
{
    return photons < 0 ? 0 : static_cast<std::uint64_t>(photons);
}

}  // namespace

void bind_medium(py::module_& m)
{
    py::class_<Medium>(m, "Medium", R"(A homogeneous, plane-parallel, dimensionless medium.

Parameters
----------
g : float
    Henyey-Greenstein anisotropy, -0.99 to 0.99.
ior : float
    Refractive index inside over outside, 1 to 3.
thickness : float
    In mean free paths, > 0; ``inf`` is a half-space.

Raises
------
ValueError
    An argument is outside its range. Names argument, value and range.
)")
        .def(py::init([](double g, double ior, double thickness) {
                 const Medium medium{g, ior, thickness};
                 validate(medium);
                 return medium;
             }),
             py::arg("g") = 0.8, py::arg("ior") = 1.0, py::arg("thickness") = std::numeric_limits<double>::infinity())
        .def_readonly("g", &Medium::g)
        .def_readonly("ior", &Medium::ior)
        .def_readonly("thickness", &Medium::thickness)
        // For other types Python compares identities, as for its own types.
        .def(
            "__eq__", [](const Medium& a, const Medium& b) { return a == b; }, py::is_operator())
        .def("__hash__", [](const Medium& a) { return py::hash(py::make_tuple(a.g, a.ior, a.thickness)); })
        .def("__repr__",
             [](const Medium& a) {
                 return py::str("Medium(g={}, ior={}, thickness={})").format(a.g, a.ior, a.thickness);
             })
        .def(py::pickle(
            [](const Medium& a) { return py::make_tuple(a.g, a.ior, a.thickness); },
            [](const py::tuple& t) { return Medium{t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>()}; }));
    m.def("fresnel", py::vectorize(&fresnel), py::arg("cos_theta_i"), py::arg("eta"),
          "Reflectance of unpolarized light; eta is the index behind the boundary over the index before it.");
}

void bind_transport(py::module_& m)
{
    m.def(
        "simulate",
        [](const Medium& medium, const std::vector<double>& angles, std::int64_t photons, std::uint64_t seed,
           int threads, const py::object& progress, const std::string& kernel, const std::vector<double>& curvatures) {
            Progress report(progress_callback(progress));
            const py::gil_scoped_release release;
            return std::make_shared<LdfLibrary>(
                simulate_library(medium, angles, photon_count(photons), seed, threads, kernel, report, curvatures));
        },
        py::arg("medium"), py::arg("angles"), py::arg("photons"), py::arg("seed") = 1, py::arg("threads") = 0,
        py::arg("progress") = py::none(), py::arg("kernel") = "", py::arg("curvatures") = std::vector<double>(),
        R"(Simulate light inside a medium by Monte Carlo.

One simulation serves every albedo, because light that leaves is tallied by scattering order.

Parameters
----------
medium : Medium
angles : sequence of float
    Angles of incidence, degrees from the surface normal, 0 <= angle < 90, distinct.
photons : int
    Photons per angle, at least 1.
seed : int
    Seed of the random numbers. The result depends on it, and not on the number of threads.
threads : int
    Number of threads; 0: all.
progress : callable, optional
    Called with the finished fraction. Returning False (or NumPy's) stops the simulation; exceptions pass through.
kernel : str
    One of `walk_kernels()`; empty: the fastest. Kernels agree up to the simulation's noise.
curvatures : sequence of float
    Curvatures of the surface, 1/mfp, from -100 to 100 and distinct; 0, a plane, is always simulated besides. Above 0
    the medium is a ball of radius ``1 / curvature``, below 0 it surrounds a hollow ball. Only half-spaces may have them.
    Light counts where it leaves if it has scattered; what crosses a hollow and enters again is not followed.

Returns
-------
LdfLibrary

Raises
------
ValueError
    An argument is outside its range. Names argument, value and range.
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

The last, `scalar`, walks one photon at a time in double precision. It is the reference for the others, which walk one
photon per vector lane in single precision.
)");
    m.def("exact_totals", &exact, py::arg("medium"), py::arg("angles"), py::arg("albedos"), py::arg("threads") = 0,
          R"(Reflectance and transmittance of a medium without noise, by discrete ordinates and doubling of layers.

Solves the plane-parallel problem (van de Hulst 1980; Prahl, van Gemert, Welch 1993, doi:10.1364/AO.32.000559), without
the positions at which light leaves. Checks simulations and calibrates libraries. Twice as many directions change the
results by less than 1e-4 of each for -.95 <= g <= .95 and angles up to 88 degrees.

Parameters
----------
medium : Medium
angles : sequence of float
    Angles of incidence, degrees from the surface normal, 0 <= angle < 90.
albedos : sequence of float
    Single-scattering albedos, 0 <= albedo < 1.
threads : int
    Number of threads; 0: all. The result does not depend on it.

Returns
-------
reflectance, transmittance : float64, shape (angles, albedos)
    Power per unit incident power, as `LdfLibrary.reflectance` and `LdfLibrary.transmittance`.

Raises
------
ValueError
    An argument is outside its range. Names argument, value and range.
)");
}

}  // namespace beamspread
