// pybind11 behind one header, with what every binding file shares.
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

// Of functions that run without the interpreter.
using ReleaseGil = py::call_guard<py::gil_scoped_release>;

// C-contiguous arrays of exactly this type; another type raises TypeError instead of being copied silently.
template <class T>
using Array = py::array_t<T, py::array::c_style>;

// A callback for Progress that calls `progress(fraction)` with the GIL held and lets Ctrl-C through; with None nothing
// is reported. Only an answer of False or of NumPy's False_ stops: a callback without a return statement, or one that
// returns what a method happened to, does not mean to. `progress` must outlive the callback; throws InvalidArgument
// unless it can be called.
Progress::Callback progress_callback(const py::object& progress);

// Values of an array argument as C-contiguous doubles or floats. Throws InvalidArgument for what would lose something
// on the way: masks, imaginary parts, and what is no number.
template <class T>
Array<T> real_array(const std::string& name, const py::object& values);

// "float32 of shape (4, 3)"
std::string shape_text(const py::array& array);

inline std::size_t side(const py::array& array, py::ssize_t axis)
{
    return static_cast<std::size_t>(array.shape(axis));
}

// What a name stands for; throws InvalidArgument for one that is not known.
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

// "reflected" or "transmitted"; throws InvalidArgument.
Side side_from_name(const std::string& name);

// Texels along a side of an LDF's image; throws InvalidArgument for a negative number.
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
void bind_light_field(py::module_& m);
void bind_fft(py::module_& m);

}  // namespace beamspread
