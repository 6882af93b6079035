// Small vectors from Python's sequences of numbers.
#pragma once

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

// Throws InvalidArgument.
inline Vec3 to_vec3(const std::string& name, const Numbers& numbers)
{
    if (numbers.ndim() != 1 || numbers.size() != 3)
        reject(name, shape_text(numbers), "3 numbers");
    return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

}  // namespace beamspread
