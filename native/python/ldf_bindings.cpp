#include <algorithm>
#include <memory>

#include "ldf/library/ldf_library.h"
#include "python/casters.h"

namespace beamspread {

namespace {

// Image of a library by `make`: ldf_image or ldf_image_standard_error.
template <auto make, class... More>
Array<float> image(const LdfLibrary& library, double angle, double albedo, std::ptrdiff_t size, double pitch,
                   const std::string& side, double beam_diameter, More... more)
{
    const Side image_of = side_from_name(side);
    const std::size_t texels_along = image_side(size);
    std::vector<float> texels;
    {
        const py::gil_scoped_release release;
        texels = make(library, angle, albedo, texels_along, pitch, image_of, beam_diameter, more...);
    }
    return to_array<float>(std::move(texels), {texels_along, texels_along});
}

}  // namespace

void bind_ldf(py::module_& m)
{
    const py::class_<LdfSource, std::shared_ptr<LdfSource>> source(m, "LdfSource",
                                                                   "LDFs of one medium, for `convolve`.");
    py::class_<LdfLibrary, LdfSource, std::shared_ptr<LdfLibrary>> library(
        m, "LdfLibrary",
        R"(Luminance distribution functions of one medium.

Made by `simulate`, `library` or `LdfLibrary.load`. Angles are in degrees from the surface normal, within the simulated
ones (a library that reaches 88 degrees serves up to 90); albedos are in [0, 1).
)");
    library
        .def_static("load", &load_library, py::arg("path"), ReleaseGil(),
                    "Read a library from an OpenEXR file; OSError if it is missing, damaged or no library.")
        .def("save", &save_library, py::arg("path"), py::arg("with_plane") = true, ReleaseGil(),
             R"(Write a multi-part OpenEXR file; an existing file is replaced only by a complete one.

Without the plane, a file has the other `curvatures` alone, for `with_curved_from`.
)")
        .def(
            "with_curved_from",
            [](const LdfLibrary& self, const std::filesystem::path& path) {
                return self.with_curved(load_curved(path));
            },
            py::arg("path"), ReleaseGil(),
            R"(A copy with the curvatures of a file instead of its own.

Raises OSError for a file that is missing, damaged or no library, and ValueError for one of another medium.
)")
        .def(
            "with_curved",
            [](const LdfLibrary& self, const std::vector<double>& curvatures, const std::vector<double>& angles,
               std::int64_t photons, std::uint64_t seed, int threads, const py::object& progress,
               const std::string& kernel) {
                Progress report(progress_callback(progress));
                const py::gil_scoped_release release;
                return self.with_curved(simulate_curved(self.medium(), curvatures, angles,
                                                        photons < 0 ? 0 : static_cast<std::uint64_t>(photons), seed,
                                                        threads, kernel, report));
            },
            py::arg("curvatures"), py::arg("angles"), py::arg("photons"), py::arg("seed") = 1, py::arg("threads") = 0,
            py::arg("progress") = py::none(), py::arg("kernel") = "",
            R"(A copy with simulated curvatures instead of its own.

Arguments are those of `simulate`. Curved surfaces may have fewer angles than the plane: between them the difference to
the plane is interpolated.
)")
        .def_property_readonly("medium", &LdfLibrary::medium)
        .def_property_readonly("angles", &LdfLibrary::angles_deg, "Simulated angles, degrees, ascending.")
        .def_property_readonly("photons", &LdfLibrary::photons, "Photons per angle.")
        .def_property_readonly("seed", &LdfLibrary::seed)
        .def_property_readonly("curvatures", &LdfLibrary::curvatures,
                               "Simulated curvatures of the surface, 1/mfp, ascending; 0 is a plane. Between them the "
                               "LDF is linear in the curvature.")
        .def_property_readonly("is_calibrated", &LdfLibrary::is_calibrated, "True if `calibrated` made it.");
    library
        .def(
            "reflectance",
            [](const LdfLibrary& self, double angle, double albedo, double curvature) {
                return self.total(angle, albedo, Side::reflected, curvature);
            },
            py::arg("angle"), py::arg("albedo"), py::arg("curvature") = 0.0,
            R"(Diffuse reflectance: power that leaves per unit incident power, specular reflection excluded.

On a ball (`curvature` above 0) it leaves out light that crosses without scattering. Raises ValueError outside the
range of `curvatures`.
)")
        .def(
            "transmittance",
            [](const LdfLibrary& self, double angle, double albedo) {
                return self.total(angle, albedo, Side::transmitted);
            },
            py::arg("angle"), py::arg("albedo"),
            "Power that leaves the far side per unit incident power, the unscattered beam included.")
        .def(
            "standard_error",
            [](const LdfLibrary& self, double angle, double albedo, const std::string& side, double curvature) {
                return self.standard_error(angle, albedo, side_from_name(side), curvature);
            },
            py::arg("angle"), py::arg("albedo"), py::arg("side") = "reflected", py::arg("curvature") = 0.0,
            R"(Standard error of `reflectance` or `transmittance`.

It follows from the scatter of 32 independent batches, without the error of interpolation between angles. For a
calibrated library it includes that error, which `exact_totals` gives halfway between simulated angles.
)")
        .def("calibrated", &calibrated, py::arg("threads") = 0, ReleaseGil(),
             R"(A copy whose totals are those of `exact_totals`.

The light of each scattering order is scaled, by the smallest change (least squares weighted by statistical variance)
that makes the totals exact at 16 albedos from .01 to .99999; other albedos, and the totals of all maps, follow.
`standard_error` then includes the errors of `exact_totals` and of interpolation between angles. `image_standard_error`
stays that of the simulation, an upper bound. Totals of twelve media are within 3 % of the incident power with 100
photons and within .5 % with 1000; for albedos above .99999 they may be 1.5 % too large.

Parameters
----------
threads : int
    Number of threads; 0: all. The result does not depend on it.

Returns
-------
LdfLibrary

Raises
------
ValueError
    The library was simulated with fewer than 100 photons per angle.
)")
        .def("diffuse_reflectance", &LdfLibrary::diffuse_reflectance, py::arg("albedo"),
             "Reflectance under uniform diffuse light; needs a library from 0 to at least 88 degrees.");
    library
        .def("image", &image<ldf_image, double>, py::arg("angle"), py::arg("albedo"), py::arg("size"), py::arg("pitch"),
             py::arg("side") = "reflected", py::arg("beam_diameter") = 0.0, py::arg("curvature") = 0.0,
             R"(The LDF as texel means.

Parameters
----------
angle, albedo : float
size : int
    Texels along each side, 1 to 16384.
pitch : float
    Side of a texel, mean free paths, 1e-6 to 1e18; at least 1e-4 for a beam with a diameter.
side : {"reflected", "transmitted"}
beam_diameter : float
    Diameter of the disk around O that the beam lights evenly on the surface, mean free paths, up to 1e6 and 1e4 texels;
    0: a pencil beam.
curvature : float
    Curvature of the surface, 1/mfp, within `curvatures`. The image of a curved surface shows chords: a texel's distance
    from O is the straight distance from O to a point of the surface, its azimuth that of the chord in the tangent plane
    at O. Areas are true, since a ball's area within a chord c is pi c^2.

Returns
-------
float32, shape (size, size)
    1/mfp^2; rows v, columns u, O at the centre, +u (the beam's direction of travel) to the right. Few texels may be
    slightly negative, where azimuthal harmonics undershoot.

Raises
------
ValueError
    An argument is outside its range. Names argument, value and range.
)")
        .def("image_standard_error", &image<ldf_image_standard_error>, py::arg("angle"), py::arg("albedo"),
             py::arg("size"), py::arg("pitch"), py::arg("side") = "reflected", py::arg("beam_diameter") = 0.0,
             R"(Statistical standard error of every texel of `image`.

It follows from the scatter between eight groups of the simulation's photons and has a relative error of about a quarter
(less between simulated angles, where several simulations add up). Parameters, units and errors are those of `image`.

Returns
-------
float32, shape (size, size)
    1/mfp^2; 0 for texels that no photon came near.
)")
        .def("__repr__", [](const LdfLibrary& self) {
            return py::str("<LdfLibrary {} angles={} photons={}>")
                .format(self.medium(), self.angles_deg(), self.photons());
        });
}

}  // namespace beamspread
