// Fourier transforms of many lines in single precision: DUCC behind one header, compiled for several instruction
// sets, the best of which is chosen at run time.
#pragma once

#include <complex>
#include <cstddef>
#include <string>
#include <vector>

#include "fft/instruction_sets/fft.h"

namespace beamspread {

using Complex = std::complex<float>;

// The smallest even size of at least `min_size` whose transforms are fast.
std::size_t fast_even_size(std::size_t min_size);

// The fastest that this processor has.
const FftInstructionSet& fft();

// Two-dimensional transform of (height, width) real values, width even: (height, width / 2 + 1) frequencies. What the
// cost of the solver is counted in.
void real_to_half_2d(const FftInstructionSet& instructions, const float* real, Complex* half, std::size_t height,
                     std::size_t width, int threads);

// What the transforms were compiled for and this processor has, fastest first: "avx512", "avx2", "baseline".
std::vector<std::string> fft_instruction_sets();

// The transforms as compiled for one of these, so that tests reach each of them; empty: the fastest. Throws
// InvalidArgument.
const FftInstructionSet& fft_instruction_set(const std::string& instruction_set);

}  // namespace beamspread
