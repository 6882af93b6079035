#include "fft/fft.h"

#include "base/error.h"
#include "python/casters.h"

namespace beamspread {

namespace {

// Number of lines, and of values in each.
std::pair<std::size_t, std::size_t> lines_of(const std::string& name, const py::array& array)
{
    if (array.ndim() != 2 || array.shape(0) == 0 || array.shape(1) == 0)
        reject(name, shape_text(array), "(lines, values), not empty");
    return {side(array, 0), side(array, 1)};
}

Array<Complex> real_transform(const Array<float>& values, int threads, const std::string& instruction_set)
{
    const auto [height, width] = lines_of("values", values);
    if (width % 2 != 0)
        reject("values", std::to_string(width) + " columns", "an even number of columns");
    const FftInstructionSet& instructions = fft_instruction_set(instruction_set);
    Array<Complex> spectrum({height, width / 2 + 1});
    Complex* out = spectrum.mutable_data();
    const float* in = values.data();
    const py::gil_scoped_release release;
    real_to_half_2d(instructions, in, out, height, width, threads);
    return spectrum;
}

Array<Complex> real_lines(const Array<float>& values, const std::string& instruction_set)
{
    const auto [count, size] = lines_of("values", values);
    Array<Complex> half({count, size / 2 + 1});
    fft_instruction_set(instruction_set).real_to_half(values.data(), half.mutable_data(), count, size);
    return half;
}

Array<float> half_lines(const Array<Complex>& half, std::size_t size, const std::string& instruction_set)
{
    const auto [count, frequencies] = lines_of("half", half);
    if (size / 2 + 1 != frequencies)
        reject("size", static_cast<double>(size), "one whose half has as many frequencies as the lines");
    Array<float> values({count, size});
    fft_instruction_set(instruction_set).half_to_real(half.data(), values.mutable_data(), count, size);
    return values;
}

Array<Complex> complex_lines(const Array<Complex>& values, bool forward, const std::string& instruction_set)
{
    const auto [count, size] = lines_of("values", values);
    Array<Complex> result({count, size});
    std::copy_n(values.data(), count * size, result.mutable_data());
    fft_instruction_set(instruction_set).complex_in_place(result.mutable_data(), count, size, forward);
    return result;
}

}  // namespace

void bind_fft(py::module_& m)
{
    m.def("fft_instruction_sets", &fft_instruction_sets,
          R"(Instruction sets of the transforms that this processor can run, fastest first; the solver uses the first.

A subset of "avx512", "avx2" and "baseline". An empty `instruction_set` of the functions below means the fastest.
)");
    m.def("fast_size", &fast_even_size, py::arg("min_size"), "The smallest even size of fast transforms.");
    m.def("real_transform", &real_transform, py::arg("values"), py::arg("threads") = 0, py::arg("instruction_set") = "",
          R"(Fourier transform of real values, float32 (H, W) with W even; complex64 (H, W / 2 + 1).

tests/bench/fft.py counts the solver's time in these.
)");
    m.def("real_lines", &real_lines, py::arg("values"), py::arg("instruction_set") = "",
          "Transforms of lines of real values: float32 (N, size) to complex64 (N, size // 2 + 1).");
    m.def("half_lines", &half_lines, py::arg("half"), py::arg("size"), py::arg("instruction_set") = "",
          "Inverse of `real_lines` but for a factor: complex64 (N, size // 2 + 1) to `size` times float32 (N, size).");
    m.def("complex_lines", &complex_lines, py::arg("values"), py::arg("forward"), py::arg("instruction_set") = "",
          "Transforms of lines of complex values, complex64 (N, size), by e^-i, or backward by e^i; both are plain "
          "sums.");
}

}  // namespace beamspread
