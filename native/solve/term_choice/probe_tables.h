// What a probe of the radiance looks up of a basis.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/aligned.h"
#include "solve/problem/light.h"
#include "solve/separable/low_rank.h"
#include "solve/term_choice/probe_loops.h"

namespace beamspread {

// Cells around a texel: the texels up to `cell_reach` away, then squares of 3 x 3 texels up to as many squares away,
// then of 9 x 9, each size around all that the one before it covers.
inline constexpr std::size_t cell_reach = 4;

// Rows of the tables hold, for each rank, the harmonics up to the last that the basis has, in whole blocks; zero for
// those that it lacks.
class ProbeTables {
public:
    ProbeTables(const LowRankBasis& basis, const Plane& plane);

    std::size_t harmonics() const { return m_harmonics; }
    std::size_t row_size() const { return m_row_size; }
    std::size_t media() const { return m_media; }
    std::size_t sizes() const { return m_sizes; }  // of cells, so that the largest cover the plane

    // Where each function of the basis is in a row, and the first harmonic of each block.
    const std::vector<std::size_t>& places() const { return m_places; }
    const std::vector<std::size_t>& columns() const { return m_columns; }

    // Functions of the angle.
    const float* at_half_tangent(float half_tangent) const
    {
        const auto step = static_cast<std::size_t>(std::max((half_tangent - m_first) * m_per_step, 0.0f));
        return m_by_angle.data() + std::min(step, angle_steps - 1) * m_row_size;
    }

    // Whether kernels end before the cell so many cells away begins.
    bool out_of_reach(std::size_t size, std::size_t dy, std::size_t dx) const;

    // Rows of a medium and of a cell so many cells away: the means over the cell of c_m(r) cos(m phi) and of c_m(r)
    // sin(m phi), phi from the cell's light to the texel, and c_m(r) at its middle.
    enum Kernel : std::size_t { cosine, sine, radial, kernels };
    const float* kernel(std::size_t size, std::size_t dy, std::size_t dx, std::size_t medium, Kernel of) const
    {
        const std::size_t cell = (size * (cell_reach + 1) + dy) * (cell_reach + 1) + dx;
        return m_kernels.data() + ((cell * m_media + medium) * kernels + of) * m_row_size;
    }

private:
    static constexpr std::size_t angle_steps = 256;

    void tabulate_angles(const LowRankBasis& basis);
    void integrate(const LowRankBasis& basis, const Plane& plane);

    std::size_t m_media;
    std::size_t m_ranks;
    std::size_t m_sizes = 1;
    std::size_t m_harmonics = 0;
    std::size_t m_row_size = 0;
    std::vector<std::size_t> m_starts;  // of each rank's harmonics in a row, and the end
    std::vector<std::size_t> m_columns;
    std::vector<std::size_t> m_places;
    double m_pitch_x;  // metres
    double m_pitch_y;
    double m_reach = 0.0;
    float m_first;
    float m_per_step;
    AlignedVector<float> m_by_angle;  // [step]
    AlignedVector<float> m_kernels;   // [size][dy][dx][medium][kernel]
};

}  // namespace beamspread
