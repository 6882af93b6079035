#include "fft/fft.h"

#include <hwy/targets.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/error.h"
#include "base/threads.h"

namespace beamspread {

namespace {

struct Named {
    const char* name;
    const FftInstructionSet* instructions;
};

// Variants that this processor can run, fastest first.
const std::vector<Named>& runnable_sets()
{
    static const std::vector<Named> sets = [] {
        std::vector<Named> runnable;
#ifdef BEAMSPREAD_FFT_INSTRUCTION_SETS
        // Highway's targets need the same instructions as the compiler's levels x86-64-v4 and -v3.
        const std::int64_t supported = hwy::SupportedTargets();
        if (supported & HWY_AVX3)
            runnable.push_back({"avx512", beamspread_fft_avx512()});
        if (supported & HWY_AVX2)
            runnable.push_back({"avx2", beamspread_fft_avx2()});
#endif
        runnable.push_back({"baseline", beamspread_fft_baseline()});
        return runnable;
    }();
    return sets;
}

}  // namespace

const FftInstructionSet& fft()
{
    static const FftInstructionSet& fastest = *runnable_sets().front().instructions;
    return fastest;
}

std::size_t fast_even_size(std::size_t min_size)
{
    // Lines whole pages apart share few lines of the cache, which takes a fifth to a third longer.
    constexpr std::size_t page = 4096 / sizeof(Complex);
    std::size_t half = fft().good_size((min_size + 1) / 2);
    while (2 * half % page == 0)
        half = fft().good_size(half + 1);
    return 2 * half;
}

void real_to_half_2d(const FftInstructionSet& instructions, const float* real, Complex* half, std::size_t height,
                     std::size_t width, int threads)
{
    const std::size_t columns = width / 2 + 1;
    with_threads(threads, [&] {
        parallel_for((height + lines_at_once - 1) / lines_at_once, [&](std::size_t item) {
            const std::size_t first = item * lines_at_once;
            const std::size_t count = std::min(lines_at_once, height - first);
            instructions.real_to_half(real + first * width, half + first * columns, count, width);
        });
        parallel_for((columns + lines_at_once - 1) / lines_at_once, [&](std::size_t item) {
            const std::size_t first = item * lines_at_once;
            const std::size_t count = std::min(lines_at_once, columns - first);
            instructions.complex_columns(half + first, count, height, columns);
        });
    });
}

std::vector<std::string> fft_instruction_sets()
{
    std::vector<std::string> names;
    for (const Named& entry : runnable_sets())
        names.emplace_back(entry.name);
    return names;
}

const FftInstructionSet& fft_instruction_set(const std::string& instruction_set)
{
    std::string allowed;
    for (const Named& entry : runnable_sets()) {
        if (instruction_set.empty() || instruction_set == entry.name)
            return *entry.instructions;
        allowed += (allowed.empty() ? "'" : ", '") + std::string(entry.name) + "'";
    }
    reject("instruction_set", "'" + instruction_set + "'", allowed + " on this processor");
}

}  // namespace beamspread
