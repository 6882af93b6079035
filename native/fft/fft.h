// Fourier transforms of many lines in single precision, by DUCC, which no other header includes, and the memory of
// planes between the transforms along x and y. Each instruction set has its own build; the best is chosen at run time.
#pragma once

#include <complex>
#include <cstddef>
#include <string>
#include <vector>

#include "base/platform.h"
#include "fft/instruction_sets/instruction_set.h"

namespace beamspread {

using Complex = std::complex<float>;

// Lines that are transformed together, a multiple of the transforms' SIMD width. More: more cache.
inline constexpr std::size_t lines_at_once = 16;

// The smallest even size of at least `min_size` whose transforms are fast.
std::size_t fast_even_size(std::size_t min_size);

// The fastest variant that this processor can run.
const FftInstructionSet& fft();

// Two-dimensional transform of (height, width) real values, width even: (height, width / 2 + 1) frequencies. The cost
// of the solver is counted in these.
void real_to_half_2d(const FftInstructionSet& instructions, const float* real, Complex* half, std::size_t height,
                     std::size_t width, int threads);

// Instruction sets of the variants that this processor can run, fastest first: "avx512", "avx2", "baseline".
std::vector<std::string> fft_instruction_sets();

// The variant of one of these names, or the fastest if the name is empty. Throws InvalidArgument.
const FftInstructionSet& fft_instruction_set(const std::string& instruction_set);

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
          m_data(count * columns * m_stride)
    {
    }

    std::size_t count() const { return m_count; }

    Complex* column(std::size_t plane, std::size_t i) { return m_data.data() + (plane * m_columns + i) * m_stride; }

private:
    std::size_t m_count;
    std::size_t m_columns;
    std::size_t m_stride;
    HugePages<Complex> m_data;
};

}  // namespace beamspread
