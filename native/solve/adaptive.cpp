// The adaptive solver: beams of different widths (Manabe et al. 2012, section 3.3), each seen as coarsely as its
// distance allows.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/beam_basis.h"
#include "solve/far_field.h"
#include "solve/mask_pyramid.h"
#include "solve/near_field.h"
#include "solve/texel_kernel.h"

namespace beamspread {

namespace {

// Share of the tolerance that each kind of approximation may use up: light that is not quite even within a square,
// kernels farther than near_texels, distance, and directions between the nodes with harmonics left out.
constexpr double tolerance_share = 0.25;

// Texels around the pole within which TexelKernels must be exact for its tables to be off by at most `tolerance`,
// relative L1. Measured over mean free paths from 0.3 to 500 texels: 1.6e-3 at 32, falling with the third power.
std::ptrdiff_t near_texels(double tolerance)
{
    return static_cast<std::ptrdiff_t>(std::ceil(std::clamp(32.0 * std::cbrt(1.6e-3 / tolerance), 8.0, 1e6)));
}

// Every beam's kernel is a sum over terms: a factor that depends on the beam, times a kernel that does not.
struct Term {
    std::size_t node = 0;
    HarmonicSum kernel;
    Grid light;  // irradiance times factor
};

// One beam direction: one term, whose factor is one.
Term uniform_term(const Problem& problem, const Channel& channel)
{
    Term term{0, {}, Grid(problem.height, problem.width)};
    const double beta = azimuth(problem.directions.uniform);
    for (std::size_t m = 0; m < harmonic_count; ++m) {
        term.kernel.cosine[m] = std::cos(static_cast<double>(m) * beta);
        term.kernel.sine[m] = std::sin(static_cast<double>(m) * beta);
    }
    for (std::size_t y = 0; y < problem.height; ++y)
        for (std::size_t x = 0; x < problem.width; ++x)
            term.light.row(y)[x] = static_cast<double>(channel.irradiance(y, x));
    return term;
}

// Beams of many directions: weights of the nodes and azimuth at every lit texel.
class BeamField {
public:
    BeamField(const Problem& problem, const Channel& channel, const BeamBasis& basis)
        : m_light(problem.height, problem.width),
          m_beta(problem.height * problem.width),
          m_even(basis.node_count(), std::vector<double>(problem.height * problem.width)),
          m_odd(m_even)
    {
        parallel_for(problem.height, [&](std::size_t y) {
            for (std::size_t x = 0; x < problem.width; ++x) {
                const auto irradiance = static_cast<double>(channel.irradiance(y, x));
                if (irradiance == 0.0)
                    continue;
                const std::size_t texel = y * problem.width + x;
                const Vec3 direction = direction_at(problem, y, x);
                const BeamBasis::Weights weights = basis.weights(direction);
                m_light.values[texel] = irradiance;
                m_beta[texel] = azimuth(direction);
                for (std::size_t j = 0; j < basis.node_count(); ++j) {
                    m_even[j][texel] = weights.even[j];
                    m_odd[j][texel] = weights.odd[j];
                }
            }
        });
    }

    Term term(std::size_t node, std::size_t m, bool sine) const
    {
        Term term{node, {}, m_light};
        (sine ? term.kernel.sine : term.kernel.cosine)[m] = 1.0;
        const std::vector<double>& weights = m % 2 == 0 ? m_even[node] : m_odd[node];
        for (std::size_t i = 0; i < weights.size(); ++i) {
            const double phase = static_cast<double>(m) * m_beta[i];
            term.light.values[i] *= weights[i] * (sine ? std::sin(phase) : std::cos(phase));
        }
        return term;
    }

private:
    Grid m_light;
    std::vector<double> m_beta;
    std::vector<std::vector<double>> m_even;  // [node][texel]
    std::vector<std::vector<double>> m_odd;
};

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

class ChannelSolver {
public:
    ChannelSolver(const Problem& problem, const Channel& channel, const std::vector<Square>& squares,
                  Progress& progress)
        : m_problem(problem),
          m_channel(channel),
          m_squares(squares),
          m_progress(progress),
          m_far(problem.height, problem.width)
    {
    }

    std::vector<float> solve()
    {
        if (m_squares.empty()) {
            m_progress.advance(1.0);
            return std::vector<float>(m_problem.height * m_problem.width);
        }
        Grid sum(m_problem.height, m_problem.width);
        if (m_problem.directions.field)
            add_field(sum);
        else
            add_uniform(sum);
        const Grid far = m_far.sum();
        std::vector<float> luminance(sum.values.size());
        for (std::size_t i = 0; i < luminance.size(); ++i)
            luminance[i] = static_cast<float>(inv_pi * (sum.values[i] + far.values[i]));
        return luminance;
    }

private:
    void add_uniform(Grid& sum)
    {
        const Term term = uniform_term(m_problem, m_channel);
        const RadialProfile profile = BeamBasis::uniform(m_problem).profiles(m_channel)[0];
        const KernelTable kernel = kernels(profile).table(term.kernel);
        const SummedKernel summed(kernel, m_problem.height, m_problem.width);
        // One direction is exact: its share goes to distance.
        const double allowed = 2.0 * tolerance_share * m_problem.tolerance * summed.power(term.light);
        add_term(sum, term.light, kernel, summed, allowed);
        m_progress.advance(1.0);
    }

    void add_field(Grid& sum)
    {
        Problem basis_problem = m_problem;
        basis_problem.tolerance = 0.5 * tolerance_share * m_problem.tolerance;  // angles and harmonics half each
        const BeamBasis basis = BeamBasis::present_angles(basis_problem, m_channel);
        const std::vector<RadialProfile> profiles = basis.profiles(m_channel);
        const std::vector<std::size_t> harmonics = needed_harmonics({profiles}, basis_problem.tolerance);
        const BeamField beams(m_problem, m_channel, basis);

        double power = 0.0;
        std::vector<TexelKernels> node_kernels;
        for (std::size_t node = 0; node < basis.node_count(); ++node) {
            node_kernels.push_back(kernels(profiles[node]));
            const Term term = beams.term(node, 0, false);
            const KernelTable kernel = node_kernels[node].table(term.kernel);
            power += SummedKernel(kernel, m_problem.height, m_problem.width).power(term.light);
        }
        const double terms = static_cast<double>(basis.node_count() * 2 * harmonics.size());
        const double allowed = tolerance_share * m_problem.tolerance * power / terms;
        for (std::size_t node = 0; node < basis.node_count(); ++node)
            for (const std::size_t m : harmonics)
                for (const bool sine : {false, true}) {
                    if (m > 0 || !sine) {
                        const Term term = beams.term(node, m, sine);
                        const KernelTable kernel = node_kernels[node].table(term.kernel);
                        add_term(sum, term.light, kernel, SummedKernel(kernel, m_problem.height, m_problem.width),
                                 allowed);
                    }
                    m_progress.advance(1.0 / terms);
                }
    }

    TexelKernels kernels(const RadialProfile& profile) const
    {
        return TexelKernels(profile, m_problem.pitch_x / m_channel.mean_free_path,
                            m_problem.pitch_y / m_channel.mean_free_path, m_far.reach_y(), m_far.reach_x(),
                            near_texels(tolerance_share * m_problem.tolerance));
    }

    void add_term(Grid& sum, Grid light, const KernelTable& kernel, const SummedKernel& summed, double allowed_error)
    {
        const double light_before = absolute_sum(light);
        const std::vector<Square> wide = wide_beams(m_squares, light);
        if (!wide.empty()) {
            SquareBeams(light, wide).add_to(sum, summed);
            for (const Square& square : wide)
                for (std::size_t y = square.y; y < square.y + square.size; ++y)
                    std::fill_n(light.row(y) + square.x, square.size, 0.0);
        }
        // In proportion to the light: an error saved on wide beams is not spent on the texels between them.
        const double share = light_before > 0.0 ? absolute_sum(light) / light_before : 0.0;
        m_far.add(kernel, std::move(light), std::max(share * allowed_error, 0.0));
    }

    const Problem& m_problem;
    const Channel& m_channel;
    const std::vector<Square>& m_squares;
    Progress& m_progress;
    FarField m_far;
};

}  // namespace

std::vector<Square> even_squares(const Problem& problem, const View2D<const float>& irradiance)
{
    return MaskPyramid(problem, irradiance).squares(tolerance_share * problem.tolerance);
}

Luminance solve_adaptive(const Problem& problem, Progress& progress)
{
    validate(problem);
    progress.set_total(static_cast<double>(problem.channels.size()));
    Luminance luminance;
    with_threads(problem.threads, [&] {
        std::vector<Square> squares;
        const float* searched = nullptr;
        for (const Channel& channel : problem.channels) {
            if (channel.irradiance.data != searched)
                squares = even_squares(problem, channel.irradiance);
            searched = channel.irradiance.data;
            luminance.push_back(ChannelSolver(problem, channel, squares, progress).solve());
        }
    });
    progress.finish();
    return luminance;
}

}  // namespace beamspread
