// Rows of a plane after the transform along x, stored by columns for the transform along y.
#pragma once

#include <cstddef>
#include <memory>

#include "base/platform.h"
#include "fft/fft.h"

namespace beamspread {

// Planes that are transformed together share one block of memory: huge pages for each of hundreds of small planes would
// take many times their size.
class ColumnSpectra {
public:
    // The memory is not cleared.
    ColumnSpectra(std::size_t count, std::size_t columns, std::size_t rows)
        : m_count(count),
          m_columns(columns),
          // Columns a power of two apart would share few lines of the cache.
          m_stride((rows + 7) / 8 * 8 + 8),
          m_data(HugePageAllocator<Complex>().allocate(count * columns * m_stride))
    {
    }

    std::size_t count() const { return m_count; }

    Complex* column(std::size_t plane, std::size_t i) { return m_data.get() + (plane * m_columns + i) * m_stride; }

private:
    struct Free {
        void operator()(Complex* memory) const { HugePageAllocator<Complex>().deallocate(memory, 0); }
    };

    std::size_t m_count;
    std::size_t m_columns;
    std::size_t m_stride;
    std::unique_ptr<Complex, Free> m_data;
};

}  // namespace beamspread
