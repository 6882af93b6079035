// The transforms of fft/fft.h for one instruction set.
#pragma once

#include <complex>
#include <cstddef>

namespace beamspread {

// Lines are contiguous and follow each other; `real` lines have `size` values, `half` lines size / 2 + 1. All
// transforms are sums without a factor; forward ones have the sign e^-i. One thread does the work.
struct FftInstructionSet {
    void (*real_to_half)(const float*, std::complex<float>*, std::size_t count, std::size_t size);
    void (*half_to_real)(const std::complex<float>*, float*, std::size_t count, std::size_t size);
    void (*complex_in_place)(std::complex<float>*, std::size_t count, std::size_t size, bool forward);
    // Forward transform of `count` columns that lie side by side in rows `stride` apart.
    void (*complex_columns)(std::complex<float>*, std::size_t count, std::size_t size, std::size_t stride);
    std::size_t (*good_size)(std::size_t);
};

}  // namespace beamspread

// One object file per instruction set, which exports this symbol alone (cmake/ducc.cmake).
extern "C" {
const beamspread::FftInstructionSet* beamspread_fft_baseline();
const beamspread::FftInstructionSet* beamspread_fft_avx2();
const beamspread::FftInstructionSet* beamspread_fft_avx512();
}
