// Non-owning strided views of two-dimensional arrays; rows go up the plane unless said otherwise.
#pragma once

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

}  // namespace beamspread
