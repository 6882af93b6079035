// pybind11 behind one header, and conversions that the binding files share.
#pragma once

#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/progress.h"
#include "base/vec.h"
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

// Short sequence of numbers of any type, copied.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

// View of an array's rows as `Row`s. The array must consist of `Number`s and is not converted. Throws InvalidArgument.
template <class Row, class Number>
std::span<const Row> to_rows(const std::string& name, const py::array& array, const std::string& allowed)
{
    constexpr std::size_t bytes = sizeof(Number);
    constexpr std::size_t columns = sizeof(Row) / bytes;
    static_assert(columns * bytes == sizeof(Row));
    if (!py::isinstance<Array<Number>>(array) || array.ndim() != 2 || side(array, 1) != columns)
        reject(name, shape_text(array), allowed);
    return {static_cast<const Row*>(array.data()), side(array, 0)};
}

inline std::span<const Vec3> to_vertices(const py::array& array)
{
    return to_rows<Vec3, double>("vertices", array, "contiguous float64 (N, 3)");
}

inline std::span<const std::array<std::uint32_t, 3>> to_triangles(const py::array& array)
{
    return to_rows<std::array<std::uint32_t, 3>, std::uint32_t>("triangles", array, "contiguous uint32 (M, 3)");
}

// Three numbers as a vector; throws InvalidArgument.
inline Vec3 to_vec3(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 1 || numbers.size() != 3)
        reject(name, shape_text(numbers), "3 numbers");
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

// Matrix whose columns are the rows of the array, the axes of a frame. Throws InvalidArgument.
inline Mat3 to_axes(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 2 || numbers.shape(0) != 3 || numbers.shape(1) != 3)
        reject(name, shape_text(numbers), "3 x 3 numbers");
    Mat3 axes;
    for (int i = 0; i < 3; ++i)
        axes[i] = {numbers.at(i, 0), numbers.at(i, 1), numbers.at(i, 2)};
    return axes;
}

// Array of this shape that takes over the memory of values, which consist of `Number`s.
template <class Number, class T>
Array<Number> to_array(std::vector<T> values, std::initializer_list<std::size_t> shape)
{
    auto owner = std::make_unique<std::vector<T>>(std::move(values));
    const auto* const data = reinterpret_cast<const Number*>(owner->data());
    const py::capsule base(owner.release(), [](void* pointer) { delete static_cast<std::vector<T>*>(pointer); });
    return Array<Number>(shape, data, base);
}

void bind_medium(py::module_& m);
void bind_transport(py::module_& m);
void bind_ldf(py::module_& m);
void bind_ldf_sample(py::module_& m);
void bind_interpolation(py::module_& m);
void bind_image(py::module_& m);
void bind_lights(py::module_& m);
void bind_occluders(py::module_& m);
void bind_bent_texels(py::module_& m);
void bind_scene(py::module_& m);
void bind_solve(py::module_& m);
void bind_textured(py::module_& m);
void bind_bake(py::module_& m);

}  // namespace beamspread
