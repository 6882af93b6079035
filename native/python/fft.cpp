#include "fft/fft.h"

#include "base/error.h"
#include "python/casters.h"

namespace beamspread {

namespace {

const FftInstructionSet& instructions_named(const std::string& instruction_set)
{
    return fft_instruction_set(instruction_set.empty() ? fft_instruction_sets().front() : instruction_set);
}

void check_lines(const std::string& name, const py::array& array)
{
    if (array.ndim() != 2 || array.shape(0) == 0 || array.shape(1) == 0)
        reject(name, shape_text(array), "(lines, values), not empty");
}

Array<Complex> real_transform(const Array<float>& values, int threads, const std::string& instruction_set)
{
    check_lines("values", values);
    if (values.shape(1) % 2 != 0)
        reject("values", std::to_string(values.shape(1)) + " columns", "an even number of columns");
    const FftInstructionSet& instructions = instructions_named(instruction_set);
    const std::size_t height = side(values, 0);
    const std::size_t width = side(values, 1);
    Array<Complex> spectrum({height, width / 2 + 1});
    Complex* out = spectrum.mutable_data();
    const float* in = values.data();
    const py::gil_scoped_release release;
    real_to_half_2d(instructions, in, out, height, width, threads);
    return spectrum;
}

Array<Complex> real_lines(const Array<float>& values, const std::string& instruction_set)
{
    check_lines("values", values);
    const FftInstructionSet& instructions = instructions_named(instruction_set);
    const std::size_t count = side(values, 0);
    const std::size_t size = side(values, 1);
    Array<Complex> half({count, size / 2 + 1});
    instructions.real_to_half(values.data(), half.mutable_data(), count, size);
    return half;
}

Array<float> half_lines(const Array<Complex>& half, std::size_t size, const std::string& instruction_set)
{
    check_lines("half", half);
    if (size / 2 + 1 != side(half, 1))
        reject("size", static_cast<double>(size), "one whose half has as many frequencies as the lines");
    const FftInstructionSet& instructions = instructions_named(instruction_set);
    const std::size_t count = side(half, 0);
    Array<float> values({count, size});
    instructions.half_to_real(half.data(), values.mutable_data(), count, size);
    return values;
}

Array<Complex> complex_lines(const Array<Complex>& values, bool forward, const std::string& instruction_set)
{
    check_lines("values", values);
    const FftInstructionSet& instructions = instructions_named(instruction_set);
    const std::size_t count = side(values, 0);
    const std::size_t size = side(values, 1);
    Array<Complex> result({count, size});
    std::copy_n(values.data(), count * size, result.mutable_data());
    instructions.complex_in_place(result.mutable_data(), count, size, forward);
    return result;
}

}  // namespace

void bind_fft(py::module_& m)
{
    m.def("fft_instruction_sets", &fft_instruction_sets,
          R"(What the transforms were compiled for and this processor has, fastest first; the solver uses the first.

Of "avx512", "avx2" and "baseline". Where a function takes an `instruction_set`, an empty one stands for the fastest.
)");
    m.def("fast_size", &fast_even_size, py::arg("min_size"), "The smallest even size of fast transforms.");
    m.def("real_transform", &real_transform, py::arg("values"), py::arg("threads") = 0, py::arg("instruction_set") = "",
          R"(Fourier transform of real values, float32 (H, W) with W even; complex64 (H, W / 2 + 1).

One of these is what tests/bench/fft.py counts the solver's time in.
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
