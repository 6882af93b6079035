// What a probe of the luminance looks up of a basis.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/aligned.h"
#include "base/vec.h"
#include "solve/separable/low_rank.h"
#include "solve/term_choice/probe_loops.h"

namespace beamspread {

// Squares are looked at as a whole if more than so many of their size lie between them and the texel.
inline constexpr std::size_t squares_between = 2;

// Texels from the middle to the border of the 17 x 17; light from farther than `nearby_sources` is taken to be the same
// on all of them.
inline constexpr std::size_t nearby_texels = 8;
inline constexpr std::size_t nearby_sources = 16;

// The mean over the 17 x 17 takes this light in squares.
inline constexpr std::size_t nearby_level = 2;
inline constexpr std::size_t nearby_side = std::size_t{1} << nearby_level;

inline std::size_t distance(std::size_t a, std::size_t b)
{
    return a > b ? a - b : b - a;
}

// Rows of the tables hold, for each rank, the harmonics up to the last that the basis has, in whole blocks; zero for
// those that it lacks.
class ProbeTables {
public:
    // Radii are tabulated up to the diagonal of a plane of height x width texels.
    ProbeTables(const LowRankBasis& basis, double pitch_x, double pitch_y, std::size_t height, std::size_t width);

    std::size_t media() const { return m_media; }
    std::size_t ranks() const { return m_ranks; }
    std::size_t harmonics() const { return m_harmonics; }
    std::size_t functions() const { return m_starts.back(); }

    // Where a rank's harmonics are in a row, where each function of the basis is, and the first harmonic of each block.
    std::size_t start(std::size_t rank) const { return m_starts[rank]; }
    const std::vector<std::size_t>& places() const { return m_places; }
    const std::vector<std::size_t>& columns() const { return m_columns; }
    RowBlocks blocks() const { return {m_columns.data(), m_columns.size(), m_media}; }

    // The unit of radii, metres: the shorter side of a texel.
    double unit() const { return m_unit; }

    // Functions of the angle.
    const float* at_angle(const Vec3f& direction) const
    {
        const float across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
        return at_half_tangent(across / (1.0f - direction.z));
    }
    const float* at_half_tangent(float half_tangent) const
    {
        const auto step = static_cast<std::size_t>(std::max((half_tangent - m_first) * m_per_step, 0.0f));
        return m_by_angle.data() + std::min(step, angle_steps - 1) * functions();
    }

    // Beyond the reach of the kernels, or farther than the plane has texels.
    bool out_of_reach(float radius_squared) const { return radius_squared >= m_end_squared; }

    // Rows of the media: density times the area of a texel.
    const float* at_radius(std::size_t step) const { return m_by_radius.data() + step * m_media * functions(); }

    // What is left of each harmonic over a square from one side of which to the other it turns by so much, radians.
    const float* over_turn(float turn) const
    {
        const float step = std::min(turn * turn_steps_per_radian, static_cast<float>(turn_steps - 1));
        return m_by_turn.data() + static_cast<std::size_t>(step) * m_harmonics;
    }

    // Rows of the media: integrals over the texel so far away, of cosines and then of sines.
    const float* near(std::size_t dy, std::size_t dx) const
    {
        return m_near.data() + 2 * (dy * (squares_between + 1) + dx) * m_media * functions();
    }

    // Ranks of m = 0 that the mean over the 17 x 17 is made of: others are as small as its error.
    std::size_t nearby_ranks() const { return std::min(m_ranks, most_nearby_ranks); }

    // Texels [y0, y1) x [x0, x1), counted from `nearby_reach` before a square of `nearby_side`: integral over them of
    // m = 0, by the square's light.
    struct Window {
        std::size_t y0;
        std::size_t y1;
        std::size_t x0;
        std::size_t x1;
    };
    static constexpr std::size_t nearby_reach = nearby_texels + nearby_sources + 1;
    double nearby(std::size_t medium, std::size_t rank, const Window& window) const
    {
        const auto& [y0, y1, x0, x1] = window;
        const double* sums = m_nearby.data() + (medium * nearby_ranks() + rank) * nearby_size * nearby_size;
        return sums[y1 * nearby_size + x1] - sums[y0 * nearby_size + x1] - sums[y1 * nearby_size + x0] +
               sums[y0 * nearby_size + x0];
    }

private:
    static constexpr std::size_t angle_steps = 256;
    static constexpr std::size_t turn_steps = 64;
    static constexpr float turn_steps_per_radian = 64.0f;
    static constexpr std::size_t most_nearby_ranks = 4;
    static constexpr std::size_t nearby_size = 2 * nearby_reach + 2;  // a row and a column of zeros come first

    void tabulate_angles(const LowRankBasis& basis);
    void tabulate_radii(const LowRankBasis& basis, double longest);
    void tabulate_turns();
    void integrate_near(const LowRankBasis& basis);
    void integrate_nearby(const LowRankBasis& basis);

    double m_pitch_x;  // metres
    double m_pitch_y;
    double m_unit;
    std::size_t m_media;
    std::size_t m_ranks;
    std::size_t m_harmonics = 0;
    std::vector<std::size_t> m_starts;  // of each rank's harmonics, and the end of the last
    std::vector<std::size_t> m_columns;
    std::vector<std::size_t> m_places;
    float m_first;  // of the table of angles
    float m_per_step;
    AlignedVector<float> m_by_angle;  // [step]
    float m_end_squared = 0.0f;  // of the table of radii
    AlignedVector<float> m_by_radius;  // [step][medium]
    AlignedVector<float> m_by_turn;    // [step][m]
    AlignedVector<float> m_near;       // [dy][dx][phase][medium], of a quadrant
    std::vector<double> m_nearby;    // [medium][rank][y][x], summed from a corner
};

}  // namespace beamspread
