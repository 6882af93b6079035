#include "solve/fft.h"

#include <algorithm>
#include <vector>

#include "base/threads.h"
#include "solve/targets/fft.h"

namespace beamspread {

namespace {

struct Choice {
    const FftTarget* target;
    const char* name;
};

const Choice& choice()
{
    static const Choice best = []() -> Choice {
#ifdef BEAMSPREAD_FFT_TARGETS
        __builtin_cpu_init();
        // What the compiler's levels x86-64-v4 and -v3 stand for.
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
            __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
            return {beamspread_fft_avx512(), "avx512"};
        if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
            return {beamspread_fft_avx2(), "avx2"};
#endif
        return {beamspread_fft_baseline(), "baseline"};
    }();
    return best;
}

}  // namespace

std::size_t fast_even_size(std::size_t min_size)
{
    return 2 * choice().target->good_size((min_size + 1) / 2);
}

void real_to_half(const float* real, Complex* half, std::size_t count, std::size_t size)
{
    choice().target->real_to_half(real, half, count, size);
}

void half_to_real(const Complex* half, float* real, std::size_t count, std::size_t size)
{
    choice().target->half_to_real(half, real, count, size);
}

void complex_in_place(Complex* lines, std::size_t count, std::size_t size, bool forward)
{
    choice().target->complex_in_place(lines, count, size, forward);
}

void real_to_half_2d(const float* real, Complex* half, std::size_t height, std::size_t width, int threads)
{
    const std::size_t columns = width / 2 + 1;
    // Some hundred kilobytes, so that an item stays in the cache.
    constexpr std::size_t lines = 16;
    with_threads(threads, [&] {
        parallel_for((height + lines - 1) / lines, [&](std::size_t item) {
            const std::size_t first = item * lines;
            const std::size_t count = std::min(lines, height - first);
            real_to_half(real + first * width, half + first * columns, count, width);
        });
        parallel_for((columns + lines - 1) / lines, [&](std::size_t item) {
            const std::size_t first = item * lines;
            const std::size_t count = std::min(lines, columns - first);
            choice().target->complex_columns(half + first, count, height, columns);
        });
    });
}

const char* fft_instruction_set()
{
    return choice().name;
}

}  // namespace beamspread
