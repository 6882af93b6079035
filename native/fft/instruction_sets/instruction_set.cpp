// Compiled once per instruction set; BEAMSPREAD_FFT_INSTRUCTION_SET names the function that returns the variant. Only
// the templates of DUCC in use are instantiated here.
#include "fft/instruction_sets/instruction_set.h"

#include "ducc0/fft/fftnd_impl.h"

namespace {

using Complex = std::complex<float>;

void real_to_half(const float* real, Complex* half, std::size_t count, std::size_t size)
{
    const ducc0::cfmav<float> in(real, {count, size});
    const ducc0::vfmav<Complex> out(half, {count, size / 2 + 1});
    ducc0::r2c(in, out, 1, true, 1.0f, 1);
}

void half_to_real(const Complex* half, float* real, std::size_t count, std::size_t size)
{
    const ducc0::cfmav<Complex> in(half, {count, size / 2 + 1});
    const ducc0::vfmav<float> out(real, {count, size});
    ducc0::c2r(in, out, 1, false, 1.0f, 1);
}

void complex_in_place(Complex* lines, std::size_t count, std::size_t size, bool forward)
{
    const ducc0::vfmav<Complex> data(lines, {count, size});
    ducc0::c2c(data, data, {1}, forward, 1.0f, 1);
}

void complex_columns(Complex* columns, std::size_t count, std::size_t size, std::size_t stride)
{
    const ducc0::vfmav<Complex> data(columns, {size, count}, {static_cast<std::ptrdiff_t>(stride), 1});
    ducc0::c2c(data, data, {0}, true, 1.0f, 1);
}

// A fast size for lines of half the plane's length. DUCC transforms long lines of real values as complex ones of half
// the length, with fast factors up to 11, and short lines directly, with fast factors up to 5.
std::size_t good_size(std::size_t size)
{
    constexpr std::size_t long_line = 500;
    return size > long_line ? ducc0::good_size_complex(size) : ducc0::good_size_real(size);
}

constexpr beamspread::FftInstructionSet instruction_set{real_to_half, half_to_real, complex_in_place, complex_columns,
                                                        good_size};

}  // namespace

extern "C" const beamspread::FftInstructionSet* BEAMSPREAD_FFT_INSTRUCTION_SET()
{
    return &instruction_set;
}
