#include "solve/term_choice/probe_loops.h"

#include <array>
#include <cstring>

#include "base/platform.h"

namespace beamspread {

namespace {

using Block = float __attribute__((vector_size(harmonics_per_block * sizeof(float))));

[[gnu::always_inline]] inline void rotate(Block& cosine, Block& sine, const Block& by_cos, const Block& by_sin)
{
    const Block next = cosine * by_cos - sine * by_sin;
    sine = sine * by_cos + cosine * by_sin;
    cosine = next;
}

}  // namespace

BEAMSPREAD_CLONES void multiple_angles(float* cosine, float cos_angle, float sin_angle, float factor, std::size_t count)
{
    // The angle times i bit by bit of i: few steps, each for all of a block at once.
    constexpr std::array<Block, 3> bits = {Block{0, 1, 0, 1, 0, 1, 0, 1}, Block{0, 0, 1, 1, 0, 0, 1, 1},
                                           Block{0, 0, 0, 0, 1, 1, 1, 1}};
    Block cos_m = Block{} + factor;
    Block sin_m{};
    for (const Block& bit : bits) {
        rotate(cos_m, sin_m, 1.0f + bit * (cos_angle - 1.0f), bit * sin_angle);
        const float twice = 2.0f * cos_angle * sin_angle;
        cos_angle = cos_angle * cos_angle - sin_angle * sin_angle;
        sin_angle = twice;
    }
    for (std::size_t m = 0; m < count; m += harmonics_per_block) {
        std::memcpy(cosine + m, &cos_m, sizeof(cos_m));
        rotate(cos_m, sin_m, Block{} + cos_angle, Block{} + sin_angle);
    }
}

BEAMSPREAD_CLONES void add_harmonics(float* __restrict sum, const float* values, const float* by_harmonic, float factor,
                                     const std::size_t* first, std::size_t blocks)
{
    for (std::size_t block = 0; block < blocks; ++block) {
        const float* harmonics = by_harmonic + first[block];
        for (std::size_t i = 0; i < harmonics_per_block; ++i)
            sum[i] += factor * values[i] * harmonics[i];
        sum += harmonics_per_block;
        values += harmonics_per_block;
    }
}

}  // namespace beamspread
