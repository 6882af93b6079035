// Small vectors from Python's sequences of numbers.
#pragma once

#include <span>
#include <string>

#include "base/error.h"
#include "base/vec.h"
#include "python/casters.h"

namespace beamspread {

// Few numbers of any type, copied.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

inline std::string shape_text(const py::array& array)
{
    return std::string(py::str(array.dtype())) + " of shape " + std::string(py::str(array.attr("shape")));
}

// A big array: its type is never converted silently. Throws InvalidArgument.
template <class T>
std::span<const T> to_rows(const std::string& name, const py::array& array, py::ssize_t columns,
                           const std::string& allowed)
{
    if (!py::isinstance<Array<T>>(array) || array.ndim() != 2 || array.shape(1) != columns)
        reject(name, shape_text(array), allowed);
    return {static_cast<const T*>(array.data()), static_cast<std::size_t>(array.size())};
}

// Throws InvalidArgument.
inline Vec3 to_vec3(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 1 || numbers.size() != 3)
        reject(name, shape_text(numbers), "3 numbers");
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

// Rows of the array become columns of the matrix: both are the axes of something. Throws InvalidArgument.
inline Mat3 to_axes(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 2 || numbers.shape(0) != 3 || numbers.shape(1) != 3)
        reject(name, shape_text(numbers), "3 x 3 numbers");
    Mat3 axes;
    for (int i = 0; i < 3; ++i)
        axes[i] = {numbers.at(i, 0), numbers.at(i, 1), numbers.at(i, 2)};
    return axes;
}

}  // namespace beamspread
