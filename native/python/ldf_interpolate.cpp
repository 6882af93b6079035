// Python names of angular space and interpolation: AngularSpace, interpolate, SampleSource.
#include "ldf/samples/interpolate.h"

#include <memory>

#include "base/error.h"
#include "ldf/samples/angular_space.h"
#include "ldf/samples/sample_source.h"
#include "python/casters.h"

namespace beamspread {

namespace {

// An argument and its name.
struct Named {
    const char* name;
    const py::object& values;
};

// Applies a map of two numbers to two, elementwise to arrays that broadcast; numbers give numbers.
template <class Map>
py::tuple apply(const Named& first, const Named& second, const Map& map)
{
    const py::tuple both = py::module_::import("numpy").attr("broadcast_arrays")(
        real_array<double>(first.name, first.values), real_array<double>(second.name, second.values));
    const auto a = real_array<double>(first.name, both[0]);
    const auto b = real_array<double>(second.name, both[1]);
    const std::vector<py::ssize_t> shape(a.shape(), a.shape() + a.ndim());
    py::array_t<double> x(shape);
    py::array_t<double> y(shape);
    for (py::ssize_t i = 0; i < a.size(); ++i)
        map(a.data()[i], b.data()[i], x.mutable_data()[i], y.mutable_data()[i]);
    if (a.ndim() == 0)
        return py::make_tuple(x.data()[0], y.data()[0]);
    return py::make_tuple(x, y);
}

py::tuple to_angular(const AngularSpace& space, const py::object& u, const py::object& v)
{
    return apply({"u", u}, {"v", v}, [&](double x, double y, double& phi, double& psi) {
        const AngularCoordinates at = space.to_angular(Vec2(x, y));
        phi = at.phi;
        psi = at.psi;
    });
}

py::tuple to_planar(const AngularSpace& space, const py::object& phi, const py::object& psi)
{
    return apply({"phi", phi}, {"psi", psi}, [&](double azimuth, double zenith, double& u, double& v) {
        const Vec2 place = space.to_planar({azimuth, zenith});
        u = place.x;
        v = place.y;
    });
}

Interpolation method_from_name(const std::string& name)
{
    return named<Interpolation>("method", name,
                                {{"angular", Interpolation::angular},
                                 {"adaptive", Interpolation::adaptive},
                                 {"planar", Interpolation::planar}});
}

LdfSample interpolate_samples(const std::vector<std::shared_ptr<LdfSample>>& samples, double angle, double albedo,
                              std::optional<double> g, const std::string& method, std::optional<double> height)
{
    std::vector<const LdfSample*> pointers;
    for (const auto& sample : samples) {
        if (!sample)
            reject("samples", "with None", "LdfSamples");
        pointers.push_back(sample.get());
    }
    const Interpolation which = method_from_name(method);
    const py::gil_scoped_release release;
    return interpolate(pointers, angle, albedo, g, which, height);
}

std::shared_ptr<SampleSource> sample_source(const std::vector<std::shared_ptr<LdfSample>>& samples,
                                            const std::string& method)
{
    std::vector<LdfSample> copies;
    for (const auto& sample : samples) {
        if (!sample)
            reject("ldf", "with None", "LdfSamples");
        copies.push_back(*sample);
    }
    return std::make_shared<SampleSource>(std::move(copies), method_from_name(method));
}

py::tuple pair(const Vec2& place)
{
    return py::make_tuple(place.x, place.y);
}

}  // namespace

void bind_ldf_interpolate(py::module_& m)
{
    py::class_<AngularSpace> space(m, "AngularSpace", R"(The angular space of Manabe et al. 2012 (Sec. 3.2, Fig. 3).

Places P of the plane as seen from the reference point Q at `height` above the brightest point H: psi in [0, pi/2)
is the angle at Q between the normal and the direction to P, phi in [0, 2 pi) the azimuth of P around H from the
beam's direction of travel, +u: ``P = H + height tan(psi) (cos phi, sin phi)``. The paper's text takes for phi the angle
at P between the directions to O and H, which is 0 everywhere at normal incidence; its Fig. 4 shows the azimuth. The
maps therefore depend on H and the height alone.

Parameters
----------
origin : (float, float)
    O, where the beam enters, (u, v) in any unit of length.
brightest : (float, float)
    H, in the same unit.
height : float
    Of Q, in the same unit; > 0.

Raises
------
ValueError
    Names the argument, its value and what is allowed.
)");
    space
        .def(py::init([](std::array<double, 2> origin, std::array<double, 2> brightest, double height) {
                 return AngularSpace(Vec2(origin[0], origin[1]), Vec2(brightest[0], brightest[1]), height);
             }),
             py::arg("origin"), py::arg("brightest"), py::arg("height"))
        .def("to_angular", &to_angular, py::arg("u"), py::arg("v"),
             "(phi, psi) of places (u, v), elementwise for arrays; phi is 0 at H.")
        .def("to_planar", &to_planar, py::arg("phi"), py::arg("psi"),
             "(u, v) of directions, elementwise for arrays; any phi, psi in [0, pi/2).")
        .def_property_readonly("origin", [](const AngularSpace& self) { return pair(self.origin()); })
        .def_property_readonly("brightest", [](const AngularSpace& self) { return pair(self.brightest()); })
        .def_property_readonly("height", &AngularSpace::height)
        .def("__repr__", [](const AngularSpace& self) {
            return py::str("<AngularSpace origin={} brightest={} height={}>")
                .format(pair(self.origin()), pair(self.brightest()), self.height());
        });

    m.def("interpolate", &interpolate_samples, py::arg("samples"), py::arg("angle"), py::arg("albedo"),
          py::arg("g") = py::none(), py::arg("method") = "angular", py::arg("height") = py::none(),
          R"(The LDF at an angle and albedo between samples.

Parameters
----------
samples : sequence of LdfSample
    On a regular grid of angles and albedos, and of g where that differs, in any order; alike in texels and beam. Only
    the cell of the grid around what is asked for counts.
angle, albedo : float
    Within the samples' span.
g : float, optional
    Anisotropy; needed where the samples span more than one.
method : {"angular", "adaptive", "planar"}
    ``angular`` is the paper's (Eq. 3, 4): exitance is blended with linear weights at the same place of angular space, H
    and Q are blended with the same weights. ``planar`` blends at the same (u, v). ``adaptive`` blends logarithms, with
    weights that follow how LDFs change with angle and albedo: nearer to the truth, by far where albedos differ.
height : float, optional
    Of Q above H for ``angular``, mean free paths; default: two thirds of the images' width, the paper's 100 units over
    a window of 150. The result doesn't depend on it but for rounding: with the same height for all samples it cancels
    out.

Returns
-------
LdfSample
    Where a sample is asked for, its own image.

Raises
------
ValueError
    Names the argument, its value and what is allowed: outside of the samples, their span.
)");

    py::class_<SampleSource, LdfSource, std::shared_ptr<SampleSource>>(
        m, "SampleSource",
        "LdfSamples of one medium as `convolve` takes them, interpolated by a method of `interpolate`.")
        .def(py::init(&sample_source), py::arg("samples"), py::arg("method") = "angular");
}

}  // namespace beamspread
