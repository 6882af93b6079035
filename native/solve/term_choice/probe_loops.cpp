#include "solve/term_choice/probe_loops.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "simd/target_clones.h"

namespace beamspread {

namespace {

// Of harmonics.
using Block = float __attribute__((vector_size(harmonics_per_block * sizeof(float))));

[[gnu::always_inline]] inline void load(Block& block, const float* values)
{
    std::memcpy(&block, values, sizeof(block));
}

[[gnu::always_inline]] inline void store(float* values, const Block& block)
{
    std::memcpy(values, &block, sizeof(block));
}

// Multiples of an angle, block by block.
struct Multiples {
    // Angle times i bit by bit of i: few steps, each for all i at once.
    [[gnu::always_inline]] Multiples(float cos_angle, float sin_angle)
    {
        constexpr std::array<Block, 3> bits = {Block{0, 1, 0, 1, 0, 1, 0, 1}, Block{0, 0, 1, 1, 0, 0, 1, 1},
                                               Block{0, 0, 0, 0, 1, 1, 1, 1}};
        for (const Block& bit : bits) {
            const Block by_cos = 1.0f + bit * (cos_angle - 1.0f);
            const Block by_sin = bit * sin_angle;
            turn(by_cos, by_sin);
            const float twice = 2.0f * cos_angle * sin_angle;
            cos_angle = cos_angle * cos_angle - sin_angle * sin_angle;
            sin_angle = twice;
        }
        cos_block = Block{} + cos_angle;
        sin_block = Block{} + sin_angle;
    }

    [[gnu::always_inline]] void turn(const Block& by_cos, const Block& by_sin)
    {
        const Block next = cosine * by_cos - sine * by_sin;
        sine = sine * by_cos + cosine * by_sin;
        cosine = next;
    }

    [[gnu::always_inline]] void next() { turn(cos_block, sin_block); }

    Block cosine = Block{} + 1.0f;
    Block sine{};
    Block cos_block;  // of the angle that blocks are apart
    Block sin_block;
};

// The octave is read off the bits of the float. That of a squared radius has half as many steps.
[[gnu::always_inline]] inline std::int32_t find_radius_step(float square)
{
    constexpr int bits_of_part = std::numeric_limits<float>::digits - 1;
    constexpr auto one = std::bit_cast<std::int32_t>(1.0f);
    // The eighth roots of 2 .. 2^7.
    constexpr std::array<float, radius_steps / 2 - 1> edges = {1.090507733f, 1.189207115f, 1.296839555f, 1.414213562f,
                                                               1.542210825f, 1.681792831f, 1.834008086f};
    const std::int32_t beyond = std::bit_cast<std::int32_t>(square) - one;
    const std::int32_t above_one = beyond > 0 ? beyond : 0;
    const auto part = std::bit_cast<float>((above_one & ((1 << bits_of_part) - 1)) + one);
    std::int32_t step = (above_one >> bits_of_part) * static_cast<std::int32_t>(edges.size() + 1);
    for (const float edge : edges)
        step += part >= edge ? 1 : 0;
    return step;
}

}  // namespace

BEAMSPREAD_CLONES void find_views(FarBeams& beams)
{
    for (std::size_t i = 0; i < beams.count; ++i) {
        const float x = beams.x[i];
        const float y = beams.y[i];
        const float u = beams.u[i];
        const float v = beams.v[i];
        const float square = x * x + y * y;
        const float across = u * u + v * v;
        // The smallest number only counts where the beam travels straight down.
        const float per_length = 1.0f / (std::sqrt(square * across) + std::numeric_limits<float>::min());
        beams.cosine[i] = (x * u + y * v) * per_length + (across > 0.0f ? 0.0f : 1.0f);
        beams.sine[i] = (y * u - x * v) * per_length;
        beams.half_tangent[i] = std::sqrt(across) / (1.0f - beams.w[i]);
        beams.radius_step[i] = find_radius_step(square);
        // The azimuth of the texel turns by this from the square to the next.
        const float turn_x = y * beams.width[i] / square;
        const float turn_y = -x * beams.height[i] / square;
        // Where all beams travel toward or away from the texel, as below a lamp, nothing turns. Beams that have nothing to
        // do with each other turn by much, but their harmonics don't cancel for that.
        const float seen_x = turn_x - beams.turn_x[i];
        const float seen_y = turn_y - beams.turn_y[i];
        const float alone = turn_x * turn_x + turn_y * turn_y;
        const float together = seen_x * seen_x + seen_y * seen_y;
        beams.turn[i] = std::sqrt(together < alone ? together : alone);
    }
}

BEAMSPREAD_CLONES void add_far_beams(float* sums, const FarBeams& beams, const RowBlocks& blocks, float* means,
                                     std::size_t harmonics)
{
    const std::size_t count = beams.count;
    for (std::size_t i = 0; i < count; ++i) {
        Multiples angle(beams.cosine[i], beams.sine[i]);
        for (std::size_t m = 0; m < harmonics; m += harmonics_per_block, angle.next()) {
            Block left;
            load(left, beams.by_turn[i] + m);
            store(means + i * harmonics + m, beams.irradiance[i] * (angle.cosine * left));
        }
    }
    // A copy: stores to the sums could change what is read through a reference.
    const auto [first, all, media] = blocks;
    for (std::size_t k = 0; k < media; ++k)
        for (std::size_t block = 0; block < all; block += 2) {
            // Two at once keep an adder busy. The last may be twice the same.
            const std::array<std::size_t, 2> at = {block, block + 1 < all ? block + 1 : block};
            std::array<Block, 2> sum;
            for (std::size_t j = 0; j < 2; ++j)
                load(sum[j], sums + (k * all + at[j]) * harmonics_per_block);
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t j = 0; j < 2; ++j) {
                    Block mean;
                    Block by_angle;
                    Block by_radius;
                    load(mean, means + i * harmonics + first[at[j]]);
                    load(by_angle, beams.by_angle[i] + at[j] * harmonics_per_block);
                    load(by_radius, beams.by_radius[i] + (k * all + at[j]) * harmonics_per_block);
                    sum[j] += mean * by_angle * by_radius;
                }
            for (std::size_t j = 0; j < 2; ++j)
                store(sums + (k * all + at[j]) * harmonics_per_block, sum[j]);
        }
}

BEAMSPREAD_CLONES void add_harmonics(float* __restrict sum, const float* values, const float* by_harmonic,
                                     const std::size_t* first, std::size_t blocks)
{
    for (std::size_t block = 0; block < blocks; ++block) {
        const float* harmonics = by_harmonic + first[block];
        for (std::size_t i = 0; i < harmonics_per_block; ++i)
            sum[i] += values[i] * harmonics[i];
        sum += harmonics_per_block;
        values += harmonics_per_block;
    }
}

BEAMSPREAD_CLONES void multiple_angles(float* __restrict cosine, float* __restrict sine, float cos_angle,
                                       float sin_angle, std::size_t count)
{
    Multiples angle(cos_angle, sin_angle);
    for (std::size_t m = 0; m < count; m += harmonics_per_block, angle.next()) {
        store(cosine + m, angle.cosine);
        store(sine + m, angle.sine);
    }
}

}  // namespace beamspread
