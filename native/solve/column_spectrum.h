// Rows of a plane transformed along x, kept column by column for the transforms along y.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>

#ifdef __linux__
#include <sys/mman.h>
#endif

#include "solve/fft.h"

namespace beamspread {

class ColumnSpectrum {
public:
    // Not cleared.
    ColumnSpectrum(std::size_t columns, std::size_t rows)
        // Columns a power of two apart would share few lines of the cache.
        : m_stride((rows + 7) / 8 * 8 + 8)
    {
        const std::size_t bytes = (columns * m_stride * sizeof(Complex) + huge_page - 1) / huge_page * huge_page;
        void* memory = std::aligned_alloc(huge_page, bytes);
        if (memory == nullptr)
            throw std::bad_alloc();
#ifdef __linux__
        madvise(memory, bytes, MADV_HUGEPAGE);  // a hint: it may fail
#endif
        m_data.reset(static_cast<Complex*>(memory));
    }

    Complex* column(std::size_t i) { return m_data.get() + i * m_stride; }

private:
    static constexpr std::size_t huge_page = std::size_t{1} << 21;

    struct Free {
        void operator()(void* memory) const { std::free(memory); }
    };

    std::size_t m_stride;
    std::unique_ptr<Complex, Free> m_data;
};

}  // namespace beamspread
