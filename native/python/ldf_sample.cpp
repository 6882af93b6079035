// Python names of LdfSample.
#include "ldf/samples/sample.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "base/error.h"
#include "ldf/library/ldf_image.h"
#include "ldf/samples/angular_space.h"
#include "python/casters.h"

namespace beamspread {

namespace {

// Any real array: samples come from files and other programs, and are small.
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
    const Side which = side_from_name(side);
    const std::size_t texels = image_side(size);
    const py::gil_scoped_release release;
    std::vector<float> image = ldf_image(library, angle, albedo, texels, pitch, which, beam_diameter);
    LdfSample sample{texels, texels, std::move(image), pitch, angle, albedo, beam_diameter, library.medium().g};
    validate(sample);
    return sample;
}

// A view that nobody can write through: what `validate` saw holds for the sample's life.
Array<float> image_of(const py::object& self)
{
    const auto& sample = self.cast<const LdfSample&>();
    Array<float> view({sample.height, sample.width}, sample.image.data(), self);
    view.attr("setflags")(py::arg("write") = false);
    return view;
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
    Undershoots of up to 10 % of the brightest texel are taken for noise, other negative values are refused; so is a
    power, the integral, that is negative or larger than 1.05: no medium returns more than arrives, and 5 % is what a
    simulation of a thousand photons may be off.
pitch : float
    Side of a texel, mean free paths, 1e-6 to 1e18.
angle : float
    Of incidence, degrees from the surface normal, [0, 90).
albedo : float
    [0, 1).
beam_diameter : float
    Of the evenly lit disk on the surface, mean free paths; 0: a pencil beam.
g : float, optional
    Anisotropy of the medium.

Raises
------
ValueError
    Names the argument, its value and what is allowed.
)");
    sample.def(py::init(&sample_of), py::arg("image"), py::arg("pitch"), py::arg("angle"), py::arg("albedo"),
               py::arg("beam_diameter") = 0.0, py::arg("g") = py::none());
    sample.def_static("from_library", &from_library, py::arg("library"), py::arg("angle"), py::arg("albedo"),
                      py::arg("size"), py::arg("pitch"), py::arg("beam_diameter") = 0.0, py::arg("side") = "reflected",
                      "The sample whose image is `library.image(angle, albedo, size, pitch, side, beam_diameter)`.");
    sample.def_static("load", &load_sample, py::arg("path"), ReleaseGil(),
                      R"(Read a sample from an OpenEXR file, ours or another program's.

The file has one part with the channel Y (or one channel alone) and the attributes, numbers of type float, double or
int, ``pitch`` (mean free paths), ``angle`` (degrees), ``albedo``, and where known ``beamDiameter`` (mean free paths)
and ``g``. Its first line is that of the largest v.

Raises
------
OSError
    The file is missing or damaged; or it lacks, or has a wrong, attribute, channel or value, which the message names.
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
            "brightest",
            [](const LdfSample& self) {
                const Vec2 place = brightest_point(self);
                return py::make_tuple(place.x, place.y);
            },
            R"(H, the brightest point, (u, v) in mean free paths.

On v = 0, as an LDF is even in v. The image is smoothed as little as brings its noise, the part odd in v, below 1 % of
the peak; H is the vertex of a paraboloid fitted to what is within 5 % of the peak. A peak next to O that the texels
don't resolve, such as a pencil beam's, is at O.)")
        .def("__repr__", [](const LdfSample& self) {
            return py::str("<LdfSample {}x{} pitch={} angle={} albedo={} beam_diameter={} g={}>")
                .format(self.height, self.width, self.pitch, self.angle_deg, self.albedo, self.beam_diameter, self.g);
        });
}

}  // namespace beamspread
