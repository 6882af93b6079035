// Fourier transforms of many lines in single precision: DUCC behind one header, compiled for several instruction
// sets, the best of which is chosen at run time.
#pragma once

#include <complex>
#include <cstddef>

namespace beamspread {

using Complex = std::complex<float>;

// The smallest even size of at least `min_size` whose transforms are fast.
std::size_t fast_even_size(std::size_t min_size);

// Lines are contiguous and follow each other; `real` lines have `size` values, `half` lines size / 2 + 1. All
// transforms are sums without a factor; forward ones have the sign e^-i. One thread does the work.
void real_to_half(const float* real, Complex* half, std::size_t count, std::size_t size);
void half_to_real(const Complex* half, float* real, std::size_t count, std::size_t size);
void complex_in_place(Complex* lines, std::size_t count, std::size_t size, bool forward);

// Two-dimensional transform of (height, width) real values, width even: (height, width / 2 + 1) frequencies. What the
// cost of the solver is counted in.
void real_to_half_2d(const float* real, Complex* half, std::size_t height, std::size_t width, int threads);

// What the transforms were compiled for: "avx512", "avx2" or "baseline".
const char* fft_instruction_set();

}  // namespace beamspread
