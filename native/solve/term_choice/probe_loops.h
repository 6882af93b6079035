// Inner loops of the radiance probe, see base/platform.h.
#pragma once

#include <cstddef>

namespace beamspread {

// Harmonics of a block: their loops have no remainders, and their number is known when they are compiled.
inline constexpr std::size_t harmonics_per_block = 8;

// cosine[m] = factor * cos(m angle), m below count, a multiple of a block; to some m roundings
void multiple_angles(float* cosine, float cos_angle, float sin_angle, float factor, std::size_t count);

// sum[i] += factor * values[i] * by_harmonic[first[i / 8] + i % 8], in blocks of harmonics
void add_harmonics(float* sum, const float* values, const float* by_harmonic, float factor, const std::size_t* first,
                   std::size_t blocks);

}  // namespace beamspread
