// Vectors, and rows of arrays as vectors, from Python's sequences of numbers.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "base/vec.h"
#include "base/view.h"
#include "python/casters.h"
#include "scene/receiver.h"

namespace beamspread {

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

// An array of vectors for the texels of a grid, and what it holds.
inline Array<float> new_vectors(const ReceiverGrid& grid)
{
    return Array<float>({grid.height, grid.width, std::size_t{3}});
}

inline View2D<Vec3f> vectors_of(Array<float>& array)
{
    static_assert(sizeof(Vec3f) == 3 * sizeof(float));
    return {reinterpret_cast<Vec3f*>(array.mutable_data()), side(array, 0), side(array, 1), array.shape(1)};
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

}  // namespace beamspread
