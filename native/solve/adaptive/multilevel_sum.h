// Multilevel sums: light that kernels spread over a plane, on coarser grids at larger distances.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "base/progress.h"
#include "ldf/radial/radial_function.h"
#include "ldf/radial/radial_profile.h"
#include "simd/loops.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

// Columns and rows of targets that are summed together, with their sums in registers.
inline constexpr std::ptrdiff_t targets_at_once = target_columns;
inline constexpr std::size_t rows_at_once = target_rows;

// Values on a grid, row by row. Zeros pad rows to a multiple of `targets_at_once`.
struct Grid {
    std::size_t height;
    std::size_t width;
    std::size_t stride;
    std::vector<double> values;

    Grid(std::size_t grid_height, std::size_t grid_width)
        : height(grid_height),
          width(grid_width),
          stride((width + targets_at_once - 1) / targets_at_once * targets_at_once),
          values(height * stride)
    {
    }
    double* row(std::size_t y) { return values.data() + y * stride; }
    const double* row(std::size_t y) const { return values.data() + y * stride; }
};

// Some targets of a grid, in whole blocks of rows_at_once x targets_at_once.
class Targets {
public:
    Targets(std::size_t height, std::size_t width)
        : m_blocks(width / targets_at_once + 1), m_has((height / rows_at_once + 1) * m_blocks)
    {
    }

    void add(std::size_t y, std::size_t x) { m_has[block(y, x)] = 1; }
    bool has(std::size_t y, std::size_t x) const { return m_has[block(y, x)] != 0; }

private:
    std::size_t block(std::size_t y, std::size_t x) const { return y / rows_at_once * m_blocks + x / targets_at_once; }

    std::size_t m_blocks;
    std::vector<char> m_has;
};

// Values of a kernel for offsets -reach .. reach from a beam, rows upward. Zeros on both sides of a row serve targets
// beyond.
class KernelTable {
public:
    KernelTable(std::size_t reach_y, std::size_t reach_x)
        : m_reach_y(static_cast<std::ptrdiff_t>(reach_y)),
          m_reach_x(static_cast<std::ptrdiff_t>(reach_x)),
          m_values((2 * reach_y + 1) * static_cast<std::size_t>(stride()))
    {
    }

    std::ptrdiff_t reach_y() const { return m_reach_y; }
    std::ptrdiff_t reach_x() const { return m_reach_x; }

    // Pointer to the value at dx = 0; dx may be negative.
    double* row(std::ptrdiff_t dy) { return m_values.data() + (dy + m_reach_y) * stride() + stride() / 2; }
    const double* row(std::ptrdiff_t dy) const { return m_values.data() + (dy + m_reach_y) * stride() + stride() / 2; }

private:
    std::ptrdiff_t stride() const { return 2 * (m_reach_x + targets_at_once) + 1; }

    std::ptrdiff_t m_reach_y;
    std::ptrdiff_t m_reach_x;
    std::vector<double> m_values;
};

// A grid of the hierarchy. The finest is that of the texels; each next one has every other row, column, or both.
// Lengths are in mean free paths.
struct GridLevel {
    std::size_t height = 0;
    std::size_t width = 0;
    double pitch_y = 1.0;
    double pitch_x = 1.0;
    bool halves_y = false;
    bool halves_x = false;
    double near_radius = 0.0;  // distance beyond which coarser grids sum the pairs of points
};

// The grids of a plane; `near` is the near radius of each level in points of its grid. An axis is halved while it keeps
// more points than the near radius has, the axis of the finer pitch first until points are about square.
std::vector<GridLevel> grid_levels(std::size_t height, std::size_t width, double pitch_y, double pitch_x, double near);

// A combination of harmonics of one profile: the sum over m of c_m(r) (cosine[m] cos(m phi) + sine[m] sin(m phi)).
struct HarmonicSum {
    Harmonics cosine{};
    Harmonics sine{};
};

// Integrals of one profile over texels at the points of grids. Sums with other near radii, and the kernel of wide beams,
// have grids of the same pitches: each integral is found once.
class KernelIntegrals {
public:
    explicit KernelIntegrals(const RadialProfile& profile) : m_profile(profile) {}

    // Offsets (0 .. height - 1, 0 .. width - 1) of a grid; other quadrants follow by symmetry.
    struct Points {
        std::size_t height;
        std::size_t width;
        TexelIntegrals integrals;

        void copy(std::size_t to, const Points& from, std::size_t at);
        // Sets a point to the mirror image of another, on the other side of the diagonal.
        void mirror(std::size_t to, std::size_t from);
    };

    // At least as many points of a level's grid; `texels` is the finest level.
    std::shared_ptr<const Points> find(const GridLevel& texels, const GridLevel& level, std::size_t height,
                                       std::size_t width);

private:
    const RadialProfile& m_profile;
    std::map<std::pair<double, double>, std::shared_ptr<const Points>> m_points;  // by the pitches
};

// Texels of the finest grid that may have light: all, or the middle one alone.
enum class LitTexels { all, middle };

// Kernels of one profile, the power from a texel's beam in another texel, by multilevel summation (Hardy et al. 2009,
// doi:10.1016/j.parco.2008.12.005): the sum over levels k of
//   K_k(r) = K(r) w_0(r) ... w_k-1(r) (1 - w_k(r)).
// w_k rises smoothly from 0 at the beam to 1 at the near radius of level k: K_k is smooth enough for the grid of level
// k and zero beyond its near radius.
class MultilevelKernel {
public:
    MultilevelKernel(KernelIntegrals& integrals, const std::vector<GridLevel>& levels, LitTexels lit);

    // K_k for each level.
    std::vector<KernelTable> tables(const HarmonicSum& harmonics) const;

private:
    // The offsets (0 .. height - 1, 0 .. width - 1) of a level's grid.
    struct Quadrant {
        std::size_t height;
        std::size_t width;
        std::shared_ptr<const KernelIntegrals::Points> points;  // these and perhaps more
        std::vector<double> window;                             // factor of K
    };
    std::vector<Quadrant> m_levels;
};

// Adds kernel(target - source) * light(source) to sum(target) for every pair within the table's offsets, for all
// targets or `only` some. Advances the progress by `work`, row by row.
void add_pairs(Grid& sum, const Grid& light, const KernelTable& kernel, Progress& progress, double work,
               const Targets* only = nullptr);

// The sum for a kernel on several levels, of light on the finest. Cubic interpolation takes light to each coarser grid
// and sums back.
Grid multilevel_sum(const std::vector<GridLevel>& levels, const std::vector<KernelTable>& kernels, Grid light,
                    Progress& progress, double work, const Targets* only = nullptr);

// Light of one term on the plane.
Grid term_light(const LightTerms& terms, std::size_t t);

// The integrals of each profile of the terms.
std::vector<KernelIntegrals> kernel_integrals(const LightTerms& terms);

// Multilevel sums of terms. Caches the kernel of each profile.
class TermSums {
public:
    TermSums(const LightTerms& terms, std::vector<KernelIntegrals>& integrals, std::vector<GridLevel> levels,
             LitTexels lit = LitTexels::all)
        : m_terms(terms), m_integrals(integrals), m_levels(std::move(levels)), m_lit(lit)
    {
    }

    // Sum of term t, for all targets or `only` some.
    Grid sum(std::size_t t, Grid light, Progress& progress, double work, const Targets* only = nullptr);

private:
    const LightTerms& m_terms;
    std::vector<KernelIntegrals>& m_integrals;  // [profile]
    std::vector<GridLevel> m_levels;
    LitTexels m_lit;
    std::map<std::size_t, MultilevelKernel> m_kernels;
};

}  // namespace beamspread
