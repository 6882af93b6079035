// Python names of LDF samples, angular space and interpolation.
#include <algorithm>
#include <memory>
#include <utility>

#include "base/error.h"
#include "ldf/library/ldf_library.h"
#include "ldf/samples/interpolate.h"
#include "ldf/samples/ldf_sample.h"
#include "ldf/samples/sample_source.h"
#include "python/casters.h"

namespace beamspread {

namespace {

// Sample from a real array of any type. Samples are small and come from files and other programs.
LdfSample sample_of(const py::object& image, double pitch, double angle, double albedo, double beam_diameter,
                    std::optional<double> g)
{
    const Array<float> pixels = real_array<float>("image", image);
    if (pixels.ndim() != 2)
        reject("image", shape_text(py::array::ensure(image)), "real numbers, (N, M)");
    std::vector<float> texels(pixels.data(), pixels.data() + pixels.size());
    LdfSample sample{side(pixels, 1), side(pixels, 0), std::move(texels), pitch, angle, albedo, beam_diameter, g};
    validate(sample);
    return sample;
}

LdfSample from_library(const LdfLibrary& library, double angle, double albedo, std::ptrdiff_t size, double pitch,
                       double beam_diameter, const std::string& side)
{
    const Side image_of = side_from_name(side);
    const std::size_t texels = image_side(size);
    const py::gil_scoped_release release;
    std::vector<float> image = ldf_image(library, angle, albedo, texels, pitch, image_of, beam_diameter, 0.0);
    LdfSample sample{texels, texels, std::move(image), pitch, angle, albedo, beam_diameter, library.medium().g};
    validate(sample);
    return sample;
}

// Read-only view: the image stays as `validate` checked it.
Array<float> image_of(const py::object& self)
{
    const auto& sample = self.cast<const LdfSample&>();
    Array<float> view({sample.height, sample.width}, sample.image.data(), self);
    view.attr("setflags")(py::arg("write") = false);
    return view;
}

// An argument with its name.
struct Named {
    const char* name;
    const py::object& values;
};

// Applies a map of two numbers to two, elementwise to arrays after broadcasting; numbers give numbers.
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
        const Vec2 point = space.to_planar({azimuth, zenith});
        u = point.x;
        v = point.y;
    });
}

Interpolation method_from_name(const std::string& name)
{
    return named<Interpolation>("method", name,
                                {{"angular", Interpolation::angular},
                                 {"adaptive", Interpolation::adaptive},
                                 {"planar", Interpolation::planar}});
}

using Samples = std::vector<const LdfSample*>;

void check_samples(const std::string& name, const Samples& samples)
{
    if (std::ranges::find(samples, nullptr) != samples.end())
        reject(name, "with None", "LdfSamples");
}

LdfSample interpolate_samples(const Samples& samples, double angle, double albedo, std::optional<double> g,
                              const std::string& method, std::optional<double> height)
{
    check_samples("samples", samples);
    const Interpolation interpolation = method_from_name(method);
    const py::gil_scoped_release release;
    return interpolate(samples, angle, albedo, g, interpolation, height);
}

std::shared_ptr<SampleSource> sample_source(const Samples& samples, const std::string& method)
{
    check_samples("ldf", samples);
    std::vector<LdfSample> copies;
    for (const LdfSample* sample : samples)
        copies.push_back(*sample);
    return std::make_shared<SampleSource>(std::move(copies), method_from_name(method));
}

py::tuple pair(const Vec2& point)
{
    return py::make_tuple(point.x, point.y);
}

}  // namespace

void bind_ldf_sample(py::module_& m)
{
    py::class_<LdfSample, std::shared_ptr<LdfSample>> sample(m, "LdfSample", R"(One LDF as an image.

Parameters
----------
image : array_like, float32, shape (N, M)
    Mean exitance of each texel per unit incident power, 1/mfp^2 (the paper's luminance, times pi); rows v upward,
    columns u; O, where the beam's axis enters, at the centre; the beam travels toward +u, to the right.
    Undershoots of up to 10 % of the brightest texel count as noise; other negative values are rejected. `convolve` also
    rejects a power (the integral) that is negative or above 1.05: no medium returns more light than arrives, and 5 % is
    the error of a simulation of a thousand photons.
pitch : float
    Side of a texel, mean free paths, 1e-6 to 1e18.
angle : float
    Angle of incidence, degrees from the surface normal, [0, 90).
albedo : float
    Single-scattering albedo, [0, 1).
beam_diameter : float
    Diameter of the evenly lit disk on the surface, mean free paths; 0: a pencil beam.
g : float, optional
    Anisotropy of the medium.

Raises
------
ValueError
    An argument is outside its range. Names argument, value and range.
)");
    sample.def(py::init(&sample_of), py::arg("image"), py::arg("pitch"), py::arg("angle"), py::arg("albedo"),
               py::arg("beam_diameter") = 0.0, py::arg("g") = py::none());
    sample.def_static("from_library", &from_library, py::arg("library"), py::arg("angle"), py::arg("albedo"),
                      py::arg("size"), py::arg("pitch"), py::arg("beam_diameter") = 0.0, py::arg("side") = "reflected",
                      "The sample whose image is `library.image(angle, albedo, size, pitch, side, beam_diameter)`.");
    sample.def_static("load", &load_sample, py::arg("path"), ReleaseGil(),
                      R"(Read a sample from an OpenEXR file of `save` or of another program.

The file has one part with the channel Y (or a single channel) and the attributes ``pitch`` (mean free paths), ``angle``
(degrees), ``albedo`` and, if known, ``beamDiameter`` (mean free paths) and ``g``, of type float, double or int. Its
first line has the largest v.

Raises
------
OSError
    The file is missing or damaged, or an attribute, channel or value is missing or wrong. The message names it.
)");
    sample.def("save", &save_sample, py::arg("path"), ReleaseGil(),
               "Write an OpenEXR file that `load` reads; an existing file is replaced only by a complete one.");
    sample.def_property_readonly("image", &image_of, "float32, shape (N, M), read-only.")
        .def_readonly("pitch", &LdfSample::pitch)
        .def_readonly("angle", &LdfSample::angle_deg)
        .def_readonly("albedo", &LdfSample::albedo)
        .def_readonly("beam_diameter", &LdfSample::beam_diameter)
        .def_readonly("g", &LdfSample::g)
        .def_property_readonly("power", &LdfSample::power,
                               "Power that leaves within the image, per unit incident power.")
        .def_property_readonly(
            "brightest", [](const LdfSample& self) { return pair(brightest_point(self)); },
            R"(H, the brightest point, (u, v) in mean free paths.

H lies on v = 0, as an LDF is even in v. The image is smoothed until its noise, the part odd in v, is below 1 % of the
peak. H is the vertex of a paraboloid fitted to the texels within 5 % of the peak. A peak beside O that the texels do
not resolve, as a pencil beam's, is at O.)")
        .def("__repr__", [](const LdfSample& self) {
            return py::str("<LdfSample {}x{} pitch={} angle={} albedo={} beam_diameter={} g={}>")
                .format(self.height, self.width, self.pitch, self.angle_deg, self.albedo, self.beam_diameter, self.g);
        });
}

void bind_interpolation(py::module_& m)
{
    py::class_<AngularSpace> space(m, "AngularSpace", R"(The angular space of Manabe et al. 2012 (Sec. 3.2, Fig. 3).

Directions to points P of the plane from the reference point Q, at `height` above the brightest point H. psi in
[0, pi/2) is the angle at Q between the normal and the direction to P; phi in [0, 2 pi) is the azimuth of P around H
from the beam's direction of travel, +u: ``P = H + height tan(psi) (cos phi, sin phi)``. The paper's text defines phi as
the angle at P between the directions to O and H, which is 0 everywhere at normal incidence; its Fig. 4 shows the
azimuth. The maps therefore depend on H and the height alone.

Parameters
----------
origin : (float, float)
    Point of entry O, (u, v) in any unit of length.
brightest : (float, float)
    Brightest point H, in the same unit.
height : float
    Height of Q, in the same unit; > 0.

Raises
------
ValueError
    An argument is outside its range. Names argument, value and range.
)");
    space
        .def(py::init([](std::array<double, 2> origin, std::array<double, 2> brightest, double height) {
                 return AngularSpace({origin[0], origin[1]}, {brightest[0], brightest[1]}, height);
             }),
             py::arg("origin"), py::arg("brightest"), py::arg("height"))
        .def("to_angular", &to_angular, py::arg("u"), py::arg("v"),
             "(phi, psi) of points (u, v), elementwise for arrays; phi is 0 at H.")
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
    Samples on a regular grid of angles, albedos and, if it differs, g, in any order, with the same texels and beam
    diameter. The cell of the grid around the request determines the result.
angle, albedo : float
    Requested angle (degrees) and albedo, within the samples' span.
g : float, optional
    Anisotropy; required if the samples span more than one.
method : {"angular", "adaptive", "planar"}
    ``angular`` is the paper's method (Eq. 3, 4): exitance is blended with linear weights at the same direction of
    angular space, H and Q with the same weights. ``planar`` blends at the same (u, v). ``adaptive`` blends logarithms
    with weights that follow the dependence of LDFs on angle and albedo: more exact, by far if albedos differ.
height : float, optional
    Height of Q above H for ``angular``, mean free paths; default: two thirds of the images' width, as the paper's 100
    units over a window of 150. It cancels, as all samples have the same height: the result depends on it by rounding
    alone.

Returns
-------
LdfSample
    The interpolated sample; a sample's own image at its angle, albedo and g.

Raises
------
ValueError
    An argument is outside its range or the samples' span. Names argument, value and range.
)");

    py::class_<SampleSource, LdfSource, std::shared_ptr<SampleSource>>(
        m, "SampleSource",
        "LDFs for `convolve` from LdfSamples of one medium, interpolated by a method of `interpolate`.")
        .def(py::init(&sample_source), py::arg("samples"), py::arg("method") = "angular");
}

}  // namespace beamspread
