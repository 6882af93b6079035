#include "solve/adaptive/adaptive.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/adaptive/far_field.h"
#include "solve/adaptive/mask_pyramid.h"
#include "solve/adaptive/near_field.h"
#include "solve/adaptive/texel_kernel.h"
#include "solve/separable/light_terms.h"

namespace beamspread {

namespace {

// Share of the tolerance that each kind of approximation may use up: light that is not quite even within a square,
// kernels farther than near_texels, distance, and terms left out where directions differ.
constexpr double tolerance_share = 0.25;

// Texels around the pole within which TexelKernels must be exact for its tables to be off by at most `tolerance`,
// relative L1. Measured over mean free paths from 0.3 to 500 texels: 1.6e-3 at 32, falling with the third power.
std::ptrdiff_t near_texels(double tolerance)
{
    return static_cast<std::ptrdiff_t>(std::ceil(std::clamp(32.0 * std::cbrt(1.6e-3 / tolerance), 8.0, 1e6)));
}

// Sums of a kernel over all offsets below and to the left of a texel's upper right corner.
class SummedKernel {
public:
    SummedKernel(const KernelTable& kernel, std::size_t grid_height, std::size_t grid_width)
        : m_height(static_cast<std::ptrdiff_t>(grid_height)),
          m_width(static_cast<std::ptrdiff_t>(grid_width)),
          m_sums(m_height, m_width + near_block)
    {
        for (std::ptrdiff_t dy = 1 - m_height; dy < m_height; ++dy) {
            double row_sum = 0.0;
            for (std::ptrdiff_t dx = 1 - m_width; dx < m_width; ++dx) {
                row_sum += kernel.row(dy)[dx];
                m_sums.row(dy)[dx] = row_sum + m_sums.row(dy - 1)[dx];
            }
        }
    }

    // Offsets -height .. height - 1, -width .. width - 1.
    const KernelTable& table() const { return m_sums; }

    // Power that the lights leave on the plane.
    double power(const Grid& light) const
    {
        double sum = 0.0;
        for (std::ptrdiff_t y = 0; y < m_height; ++y)
            for (std::ptrdiff_t x = 0; x < m_width; ++x) {
                const double* top = m_sums.row(m_height - 1 - y);
                const double* below = m_sums.row(-1 - y);
                const double on_plane = top[m_width - 1 - x] - top[-1 - x] - below[m_width - 1 - x] + below[-1 - x];
                sum += light.row(static_cast<std::size_t>(y))[x] * on_plane;
            }
        return sum;
    }

private:
    std::ptrdiff_t m_height;
    std::ptrdiff_t m_width;
    KernelTable m_sums;
};

// Light in squares, as steps at their corners: a square is the sum of four steps, each lit without end above and to the
// right of a corner. Where squares of the same light meet, their steps cancel.
class SquareBeams {
public:
    SquareBeams(const Grid& light, const std::vector<Square>& squares) : m_steps(light.height + 1, light.width + 1)
    {
        for (const Square& square : squares) {
            const double mean = mean_light(light, square);
            m_steps.row(square.y)[square.x] += mean;
            m_steps.row(square.y)[square.x + square.size] -= mean;
            m_steps.row(square.y + square.size)[square.x] -= mean;
            m_steps.row(square.y + square.size)[square.x + square.size] += mean;
        }
    }

    std::size_t count_steps() const
    {
        const std::vector<double>& steps = m_steps.values;
        return steps.size() - static_cast<std::size_t>(std::count(steps.begin(), steps.end(), 0.0));
    }

    // The luminance of a step is the sum of the kernel over the offsets below and to the left.
    void add_to(Grid& sum, const SummedKernel& summed) const
    {
        const KernelTable* table = &summed.table();
        add_near(sum, m_steps, {static_cast<std::ptrdiff_t>(sum.height + sum.width), {table, table, table, table}});
    }

private:
    static double mean_light(const Grid& light, const Square& square)
    {
        // Around the first texel, so that even light has exactly its own value as mean.
        const double first = light.row(square.y)[square.x];
        double sum = 0.0;
        for (std::size_t y = square.y; y < square.y + square.size; ++y)
            for (std::size_t x = square.x; x < square.x + square.size; ++x)
                sum += light.row(y)[x] - first;
        return first + sum / static_cast<double>(square.size * square.size);
    }

    Grid m_steps;
};

std::vector<Square> at_least(const std::vector<Square>& squares, std::size_t size)
{
    std::vector<Square> large;
    std::copy_if(squares.begin(), squares.end(), std::back_inserter(large),
                 [size](const Square& square) { return square.size >= size; });
    return large;
}

// The squares that are cheaper as wide beams, seen by every texel, than as single texels seen coarsely from afar.
std::vector<Square> wide_beams(const std::vector<Square>& squares, const Grid& light)
{
    // Typical radius within which a texel's beam is added texel by texel.
    constexpr std::ptrdiff_t typical_radius = 12;
    const double texel_cost = near_cost(typical_radius, light.height, light.width);
    const auto texels = static_cast<double>(light.values.size());
    std::vector<Square> best;
    double best_saving = 0.0;
    for (std::size_t size = 4; size <= std::max(light.height, light.width); size *= 2) {
        std::vector<Square> large = at_least(squares, size);
        if (large.empty())
            break;
        double lit = 0.0;
        for (const Square& square : large)
            lit += static_cast<double>(square.size * square.size);
        // Summing the kernel up costs about as much as ten steps.
        const double steps = static_cast<double>(SquareBeams(light, large).count_steps()) + 10.0;
        const double saving = lit * texel_cost - steps * texels;
        if (saving > best_saving) {
            best_saving = saving;
            best = std::move(large);
        }
    }
    return best;
}

HarmonicSum harmonic_sum(const std::vector<KernelTerm>& terms)
{
    HarmonicSum sum;
    for (const KernelTerm& term : terms)
        (term.phase == Phase::cosine ? sum.cosine : sum.sine)[term.m] += term.weight;
    return sum;
}

// Whether the kernel has a harmonic 0; the others have no power, all around taken together.
bool has_power(const LightTerm& term)
{
    return std::any_of(term.kernels[0].begin(), term.kernels[0].end(), [](const KernelTerm& k) { return k.m == 0; });
}

class ChannelSolver {
public:
    ChannelSolver(const Plane& plane, const Light& light, const ChannelMedium& medium, double tolerance,
                  Progress& progress)
        : m_plane(plane),
          m_light(light),
          m_medium(medium),
          m_tolerance(tolerance),
          m_squares(even_squares(plane, light, tolerance)),
          m_progress(progress),
          m_far(plane.height, plane.width)
    {
    }

    std::vector<float> solve()
    {
        if (m_squares.empty()) {
            m_progress.advance(1.0);
            return std::vector<float>(m_plane.height * m_plane.width);
        }
        Grid sum(m_plane.height, m_plane.width);
        add_terms(sum);
        const Grid far = m_far.sum();
        std::vector<float> luminance(sum.values.size());
        for (std::size_t i = 0; i < luminance.size(); ++i)
            luminance[i] = static_cast<float>(inv_pi * (sum.values[i] + far.values[i]));
        return luminance;
    }

private:
    // Each beam's kernel is a sum over terms, of a factor that depends on the beam times a kernel that does not.
    void add_terms(Grid& sum)
    {
        // Half a share for directions: what is left out is a root mean square, and a single texel may be farther off.
        const double kernel_error = 0.5 * tolerance_share * m_tolerance;
        Problem problem{m_plane, {m_medium}, {m_light}};
        problem.lights.front().color = {1.0};
        const LightTerms terms = light_terms(
            problem, 1e-3 * kernel_error, [&](const KernelDecomposition& kernels, const Incidence&, const LightTerms&) {
                return kernels.within(kernel_error);
            });
        std::vector<TexelKernels> kernels;
        for (const ScaledProfile& profile : terms.profiles)
            kernels.emplace_back(profile.profile, m_plane.pitch_x / m_medium.mean_free_path,
                                 m_plane.pitch_y / m_medium.mean_free_path, m_far.reach_y(), m_far.reach_x(),
                                 near_texels(tolerance_share * m_tolerance));
        KernelTable kernel;
        std::optional<std::size_t> tabulated;  // the term whose kernel that is
        const auto tabulate = [&](std::size_t t) {
            const std::vector<KernelTerm>& parts = terms.terms[t].kernels[0];
            if (tabulated != t)
                kernel = kernels[parts.front().profile].table(harmonic_sum(parts));
            tabulated = t;
        };

        double power = 0.0;
        for (std::size_t t = 0; t < terms.terms.size(); ++t)
            if (has_power(terms.terms[t])) {
                tabulate(t);
                power += SummedKernel(kernel, m_plane.height, m_plane.width).power(light(terms, t));
            }
        const auto count = static_cast<double>(terms.terms.size());
        // One direction leaves nothing out: its share goes to distance. The errors of many terms have nothing to do
        // with each other, so that their squares add up.
        const double allowed = (std::holds_alternative<OneDirection>(m_light.directions) ? 2.0 : 1.0) *
                               tolerance_share * m_tolerance * std::max(power, 0.0) / std::sqrt(count);
        for (std::size_t t = 0; t < terms.terms.size(); ++t) {
            tabulate(t);
            add_term(sum, light(terms, t), kernel, allowed);
            m_progress.advance(1.0 / count);
        }
    }

    // Light of one term on the plane.
    Grid light(const LightTerms& terms, std::size_t index) const
    {
        Grid grid(m_plane.height, m_plane.width);
        parallel_for(grid.height, [&](std::size_t y) {
            TermRow texels;
            texels.start(terms, {y, 0, grid.width}, index, 1);
            std::copy_n(texels.values(index), grid.width, grid.row(y));
        });
        return grid;
    }

    void add_term(Grid& sum, Grid light, const KernelTable& kernel, double allowed_error)
    {
        const double light_before = absolute_sum(light);
        const std::vector<Square> wide = wide_beams(m_squares, light);
        if (!wide.empty()) {
            SquareBeams(light, wide).add_to(sum, SummedKernel(kernel, light.height, light.width));
            for (const Square& square : wide)
                for (std::size_t y = square.y; y < square.y + square.size; ++y)
                    std::fill_n(light.row(y) + square.x, square.size, 0.0);
        }
        // In proportion to the light: an error saved on wide beams is not spent on the texels between them.
        const double share = light_before > 0.0 ? absolute_sum(light) / light_before : 0.0;
        m_far.add(kernel, std::move(light), share * allowed_error);
    }

    const Plane& m_plane;
    const Light& m_light;
    const ChannelMedium& m_medium;
    double m_tolerance;
    std::vector<Square> m_squares;
    Progress& m_progress;
    FarField m_far;
};

}  // namespace

std::vector<Square> even_squares(const Plane& plane, const Light& light, double tolerance)
{
    return MaskPyramid(plane, light).squares(tolerance_share * tolerance);
}

std::vector<float> solve_adaptive(const Plane& plane, const Light& light, const ChannelMedium& medium, double tolerance,
                                  Progress& progress)
{
    return ChannelSolver(plane, light, medium, tolerance, progress).solve();
}

}  // namespace beamspread
