// The adaptive solver: beams of different widths (Manabe et al. 2012, section 3.3), each seen as coarsely as its
// distance allows.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/beam_basis.h"
#include "solve/far_field.h"
#include "solve/mask_pyramid.h"
#include "solve/row_sum.h"
#include "solve/texel_kernel.h"

namespace beamspread {

namespace {

// Texels around the pole whose kernel is integrated exactly, see texel_kernel.
constexpr std::ptrdiff_t near_texels = 32;

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
        std::copy_n(channel.irradiance.row(y), problem.width, term.light.row(y));
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

// Light in squares, as steps at their corners: a square is the sum of four steps, each lit without end above and to the
// right of a corner. Where squares of the same light meet, their steps cancel.
class SquareBeams {
public:
    SquareBeams(const Grid& light, const std::vector<Square>& squares)
        : m_height(light.height), m_width(light.width), m_steps(light.height + 1, light.width + 1)
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
    void add_to(Grid& sum, const KernelTable& kernel) const
    {
        const auto height = static_cast<std::ptrdiff_t>(m_height);
        const auto width = static_cast<std::ptrdiff_t>(m_width);
        KernelTable summed(height, width);
        for (std::ptrdiff_t dy = 1 - height; dy < height; ++dy) {
            double row_sum = 0.0;
            for (std::ptrdiff_t dx = 1 - width; dx < width; ++dx) {
                row_sum += kernel.row(dy)[dx];
                summed.row(dy)[dx] = row_sum + summed.row(dy - 1)[dx];
            }
        }
        parallel_for(m_height, [&](std::size_t target) {
            for (std::size_t y = 0; y < m_steps.height; ++y) {
                const double* row = summed.row(static_cast<std::ptrdiff_t>(target) - static_cast<std::ptrdiff_t>(y));
                for (std::size_t x = 0; x < m_steps.width; ++x)
                    if (m_steps.row(y)[x] != 0.0)
                        add_scaled(sum.row(target), row - x, m_steps.row(y)[x], m_width);
            }
        });
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

    std::size_t m_height;
    std::size_t m_width;
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
    const double texel_cost = cost_of_disk(typical_radius, light.height, light.width);
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

// Least power that a lit texel's kernel leaves on the plane: that of a texel at one of its corners.
double least_power(const KernelTable& kernel, std::size_t grid_height, std::size_t grid_width)
{
    const auto height = static_cast<std::ptrdiff_t>(grid_height);
    const auto width = static_cast<std::ptrdiff_t>(grid_width);
    double least = std::numeric_limits<double>::infinity();
    for (const std::ptrdiff_t first_y : {std::ptrdiff_t{0}, 1 - height})
        for (const std::ptrdiff_t first_x : {std::ptrdiff_t{0}, 1 - width}) {
            double power = 0.0;
            for (std::ptrdiff_t y = 0; y < height; ++y)
                for (std::ptrdiff_t x = 0; x < width; ++x)
                    power += kernel.row(first_y + y)[first_x + x];
            least = std::min(least, power);
        }
    return std::max(least, 0.0);
}

class ChannelSolver {
public:
    ChannelSolver(const Problem& problem, const Channel& channel, Progress& progress)
        : m_problem(problem), m_channel(channel), m_progress(progress), m_far(problem.height, problem.width)
    {
    }

    std::vector<float> solve()
    {
        m_squares = even_squares(m_problem, m_channel.irradiance);
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
        const KernelTable kernel = table(profile, term.kernel);
        add_term(sum, term.light, kernel, 0.5 * m_problem.tolerance * lit_power(term.light, kernel));
        m_progress.advance(1.0);
    }

    void add_field(Grid& sum)
    {
        // A quarter each of the tolerance for the angles between nodes and for the harmonics left out; the other half
        // for squares and distance.
        Problem basis_problem = m_problem;
        basis_problem.tolerance = 0.25 * m_problem.tolerance;
        const BeamBasis basis = BeamBasis::present_angles(basis_problem, m_channel);
        const std::vector<RadialProfile> profiles = basis.profiles(m_channel);
        const std::vector<std::size_t> harmonics = needed_harmonics({profiles}, basis_problem.tolerance);
        const BeamField beams(m_problem, m_channel, basis);

        double power = 0.0;
        for (std::size_t node = 0; node < basis.node_count(); ++node) {
            const Term term = beams.term(node, 0, false);
            power += lit_power(term.light, table(profiles[node], term.kernel));
        }
        const double terms = static_cast<double>(basis.node_count() * 2 * harmonics.size());
        const double allowed = 0.25 * m_problem.tolerance * std::max(power, 0.0) / terms;
        for (std::size_t node = 0; node < basis.node_count(); ++node)
            for (const std::size_t m : harmonics)
                for (const bool sine : {false, true}) {
                    if (m > 0 || !sine) {
                        const Term term = beams.term(node, m, sine);
                        add_term(sum, term.light, table(profiles[node], term.kernel), allowed);
                    }
                    m_progress.advance(1.0 / terms);
                }
    }

    KernelTable table(const RadialProfile& profile, const HarmonicSum& harmonics) const
    {
        return texel_kernel(profile, harmonics, m_problem.pitch_x / m_channel.mean_free_path,
                            m_problem.pitch_y / m_channel.mean_free_path, m_far.reach_y(), m_far.reach_x(),
                            near_texels);
    }

    // A lower bound of the power that the beams leave on the plane.
    double lit_power(const Grid& light, const KernelTable& kernel) const
    {
        double sum = 0.0;
        for (const double value : light.values)
            sum += value;
        return sum * least_power(kernel, light.height, light.width);
    }

    void add_term(Grid& sum, Grid light, const KernelTable& kernel, double allowed_error)
    {
        const std::vector<Square> wide = wide_beams(m_squares, light);
        if (!wide.empty()) {
            SquareBeams(light, wide).add_to(sum, kernel);
            for (const Square& square : wide)
                for (std::size_t y = square.y; y < square.y + square.size; ++y)
                    std::fill_n(light.row(y) + square.x, square.size, 0.0);
        }
        m_far.add(kernel, std::move(light), allowed_error);
    }

    const Problem& m_problem;
    const Channel& m_channel;
    Progress& m_progress;
    FarField m_far;
    std::vector<Square> m_squares;
};

}  // namespace

std::vector<Square> even_squares(const Problem& problem, const View2D<const float>& irradiance)
{
    return MaskPyramid(problem, irradiance).squares(0.5 * problem.tolerance);
}

Luminance solve_adaptive(const Problem& problem, Progress& progress)
{
    validate(problem);
    progress.set_total(static_cast<double>(problem.channels.size()));
    Luminance luminance;
    with_threads(problem.threads, [&] {
        for (const Channel& channel : problem.channels)
            luminance.push_back(ChannelSolver(problem, channel, progress).solve());
    });
    progress.finish();
    return luminance;
}

}  // namespace beamspread
