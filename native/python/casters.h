// pybind11 behind one header, and conversions that the binding files share.
#pragma once

#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <initializer_list>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/progress.h"
#include "transport/tally/tally.h"

namespace beamspread {

namespace py = pybind11;

// Marks functions that run without the interpreter's lock.
using ReleaseGil = py::call_guard<py::gil_scoped_release>;

// C-contiguous arrays of exactly this type. Other types raise TypeError and are not converted.
template <class T>
using Array = py::array_t<T, py::array::c_style>;

// Callback for Progress that calls `progress(fraction)` with the GIL held and lets Ctrl-C through. It stops for False
// and NumPy's False_ alone, so that callbacks without a meaningful return value do not stop by accident. `progress`
// must outlive the callback. Throws InvalidArgument unless `progress` is callable or None.
Progress::Callback progress_callback(const py::object& progress);

// Values of an array argument as C-contiguous doubles or floats. Throws InvalidArgument for masked or complex arrays
// and for arrays of other objects.
template <class T>
Array<T> real_array(const std::string& name, const py::object& values);

// "float32 of shape (4, 3)"
std::string shape_text(const py::array& array);

inline std::size_t side(const py::array& array, py::ssize_t axis)
{
    return static_cast<std::size_t>(array.shape(axis));
}

// Value of a name; throws InvalidArgument for an unknown name.
template <class T>
T named(const std::string& argument, const std::string& name, std::initializer_list<std::pair<const char*, T>> known)
{
    std::string allowed;
    for (const auto& [known_name, value] : known) {
        if (name == known_name)
            return value;
        allowed += (allowed.empty() ? "'" : ", '") + std::string(known_name) + "'";
    }
    reject(argument, "'" + name + "'", allowed);
}

// Side named "reflected" or "transmitted"; throws InvalidArgument.
Side side_from_name(const std::string& name);

// Texels along a side of an LDF's image; throws InvalidArgument for numbers below 1.
std::size_t image_side(std::ptrdiff_t size);

void bind_medium(py::module_& m);
void bind_transport(py::module_& m);
void bind_ldf(py::module_& m);
void bind_ldf_sample(py::module_& m);
void bind_interpolation(py::module_& m);
void bind_image(py::module_& m);
void bind_lights(py::module_& m);
void bind_occluders(py::module_& m);
void bind_rays(py::module_& m);
void bind_scene(py::module_& m);
void bind_solve(py::module_& m);
void bind_bake(py::module_& m);

}  // namespace beamspread
