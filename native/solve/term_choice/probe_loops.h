// Inner loops of the luminance probe, see simd/target_clones.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace beamspread {

// Harmonics of a block: their loops have no remainders, and their number is known when they are compiled.
inline constexpr std::size_t harmonics_per_block = 8;

// Beams of squares as a texel sees them, as many at once as stay in the cache. Lengths are in the unit of radii.
struct FarBeams {
    static constexpr std::size_t most = 64;
    using Values = std::array<float, most>;
    using Rows = std::array<const float*, most>;

    std::size_t count = 0;
    Values x;  // from the middle of the square to the texel
    Values y;
    Values width;   // of the square
    Values height;
    Values irradiance;
    Values u;  // direction
    Values v;
    Values w;
    Values turn_x;  // of the direction's azimuth from the square to the next
    Values turn_y;

    // Set by `find_views`: the azimuth of the texel from that of the beam, by how much it turns over the square,
    // tan(theta / 2), and the step of the radius.
    Values cosine;
    Values sine;
    Values turn;
    Values half_tangent;
    std::array<std::int32_t, most> radius_step;

    // Rows of the tables, to be looked up by these.
    Rows by_radius;
    Rows by_turn;
    Rows by_angle;
};

// Steps of the radius are equal parts of octaves, so many, from the unit on.
inline constexpr std::size_t radius_steps = 16;

void find_views(FarBeams& beams);

// Rows of functions: the first harmonic of each block, and of how many media those by radius are.
struct RowBlocks {
    const std::size_t* first;
    std::size_t count;
    std::size_t media;
};

// sums[k][i] += irradiance * by_radius[k][i] * by_angle[i] * by_turn[m] * cos(m azimuth) of each beam, m the harmonic of
// i, k below the number of media. `means` has room for the harmonics, a multiple of a block, of `most` beams.
void add_far_beams(float* sums, const FarBeams& beams, const RowBlocks& blocks, float* means, std::size_t harmonics);

// sum[i] += values[i] * by_harmonic[first[i / 8] + i % 8], in blocks of harmonics
void add_harmonics(float* sum, const float* values, const float* by_harmonic, const std::size_t* first,
                   std::size_t blocks);

// cosine[m], sine[m] = cos(m angle), sin(m angle) of cos(angle), sin(angle), m below count, a multiple of a block; to
// some m roundings
void multiple_angles(float* cosine, float* sine, float cos_angle, float sin_angle, std::size_t count);

}  // namespace beamspread
