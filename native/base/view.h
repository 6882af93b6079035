// Non-owning strided views of two-dimensional arrays. Rows go up the plane.
#pragma once

#include <algorithm>
#include <cstddef>

namespace beamspread {

template <class T>
struct View2D {
    T* data = nullptr;
    std::size_t height = 0;
    std::size_t width = 0;
    std::ptrdiff_t row_stride = 0;  // in elements
    std::ptrdiff_t column_stride = 1;

    T& operator()(std::size_t y, std::size_t x) const
    {
        return data[static_cast<std::ptrdiff_t>(y) * row_stride + static_cast<std::ptrdiff_t>(x) * column_stride];
    }
    T* row(std::size_t y) const { return data + static_cast<std::ptrdiff_t>(y) * row_stride; }
};

// Copies texels [x, x + count) of a row to contiguous memory.
template <class T>
void copy_row(const View2D<const T>& view, std::size_t y, std::size_t x, std::size_t count, T* values)
{
    const T* from = view.row(y) + static_cast<std::ptrdiff_t>(x) * view.column_stride;
    if (view.column_stride == 1)
        std::copy_n(from, count, values);
    else
        for (std::size_t i = 0; i < count; ++i)
            values[i] = from[static_cast<std::ptrdiff_t>(i) * view.column_stride];
}

}  // namespace beamspread
