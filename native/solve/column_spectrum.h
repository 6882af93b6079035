// Rows of a plane transformed along x, kept column by column for the transforms along y.
#pragma once

#include <cstddef>
#include <memory>

#include "base/huge_pages.h"
#include "solve/fft.h"

namespace beamspread {

class ColumnSpectrum {
public:
    // Not cleared.
    ColumnSpectrum(std::size_t columns, std::size_t rows)
        // Columns a power of two apart would share few lines of the cache.
        : m_stride((rows + 7) / 8 * 8 + 8), m_data(HugePageAllocator<Complex>().allocate(columns * m_stride))
    {
    }

    Complex* column(std::size_t i) { return m_data.get() + i * m_stride; }

private:
    struct Free {
        void operator()(Complex* memory) const { HugePageAllocator<Complex>().deallocate(memory, 0); }
    };

    std::size_t m_stride;
    std::unique_ptr<Complex, Free> m_data;
};

}  // namespace beamspread
