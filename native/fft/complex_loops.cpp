#include "fft/complex_loops.h"

#include "base/platform.h"

namespace beamspread {

BEAMSPREAD_CLONES void add_product(Complex* sum, const float* factor, const Complex* values, std::size_t count)
{
    // std::complex is two floats by definition ([complex.numbers]).
    auto* s = reinterpret_cast<float*>(sum);
    const auto* v = reinterpret_cast<const float*>(values);
    for (std::size_t i = 0; i < count; ++i) {
        s[2 * i] += factor[i] * v[2 * i];
        s[2 * i + 1] += factor[i] * v[2 * i + 1];
    }
}

}  // namespace beamspread
