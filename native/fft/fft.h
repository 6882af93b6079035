// Fourier transforms of many lines in single precision, by DUCC, which no other header includes. Each instruction set
// has its own build; the best is chosen at run time.
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

}  // namespace beamspread
