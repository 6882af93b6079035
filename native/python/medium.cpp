#include "medium/medium.h"

#include <limits>

#include "medium/fresnel.h"
#include "medium/henyey_greenstein.h"
#include "python/casters.h"

namespace beamspread {

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
    Names the argument, its value and what is allowed.
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
        // With anything else Python goes on to compare identities, as for its own types.
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
          "Reflectance of unpolarized light; eta is the index behind the boundary over the one before it.");
    m.def("henyey_greenstein_pdf", py::vectorize(&henyey_greenstein_pdf), py::arg("cos_theta"), py::arg("g"),
          "Density per steradian of a deflection.");
    m.def("henyey_greenstein_sample", py::vectorize(&henyey_greenstein_sample), py::arg("g"), py::arg("u"),
          "Cosine of a deflection, from u uniform in [0, 1).");
}

}  // namespace beamspread
