// The fft solver: the direct solver's sums as products of spectra.
#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "solve/beam_basis.h"
#include "solve/fft.h"

namespace beamspread {

namespace {

enum class Phase { cosine, sine };

// Weights of the beams in one term of the basis: [E w_j(theta) cos or sin(m beta)].
struct BeamTerm {
    std::size_t node;
    std::size_t m;
    Phase phase;
};

// What the beams of a channel have in common with those of another one: then their spectra serve both.
bool same_beams(const Channel& a, const Channel& b)
{
    return a.irradiance.data == b.irradiance.data && a.library == b.library;
}

class Solver {
public:
    Solver(const Problem& problem, Progress& progress)
        : m_problem(problem),
          m_progress(progress),
          // Twice the size, less one: light that leaves on one side does not come back on the other.
          m_transform(2 * problem.height - 1, 2 * problem.width - 1),
          m_sums(problem.channels.size(), Spectrum())
    {
    }

    Luminance solve()
    {
        const std::size_t count = m_problem.channels.size();
        std::vector<bool> done(count, false);
        std::vector<std::vector<std::size_t>> groups;
        for (std::size_t c = 0; c < count; ++c) {
            if (done[c])
                continue;
            groups.emplace_back();
            for (std::size_t d = c; d < count; ++d) {
                if (!done[d] && same_beams(m_problem.channels[c], m_problem.channels[d])) {
                    groups.back().push_back(d);
                    done[d] = true;
                }
            }
        }
        m_progress.set_total(static_cast<double>(groups.size()));
        for (const auto& group : groups)
            solve_group(group);

        Luminance luminance;
        for (Spectrum& sum : m_sums)
            luminance.push_back(crop(m_transform.inverse(sum)));
        m_progress.finish();
        return luminance;
    }

private:
    // Nodes that keep the kernels of every channel of a group within the tolerance.
    BeamBasis group_basis(const std::vector<std::size_t>& group) const
    {
        if (!m_problem.directions.field)
            return BeamBasis::uniform(m_problem);
        BeamBasis basis = BeamBasis::present_angles(m_problem, m_problem.channels[group.front()]);
        for (std::size_t c : group) {
            BeamBasis other = BeamBasis::present_angles(m_problem, m_problem.channels[c]);
            if (other.node_count() > basis.node_count())
                basis = std::move(other);
        }
        return basis;
    }

    void solve_group(const std::vector<std::size_t>& group)
    {
        const BeamBasis basis = group_basis(group);
        std::vector<std::vector<RadialProfile>> profiles;  // [channel of the group][node]
        for (const std::size_t c : group) {
            profiles.push_back(basis.profiles(m_problem.channels[c]));
            m_sums[c].assign(m_transform.height() * (m_transform.width() / 2 + 1), {});
        }
        if (m_problem.directions.field)
            solve_field(group, basis, profiles);
        else
            solve_uniform(group, profiles);
    }

    void solve_uniform(const std::vector<std::size_t>& group, const std::vector<std::vector<RadialProfile>>& profiles)
    {
        const double beta = azimuth(m_problem.directions.uniform);
        Harmonics cosine{};
        Harmonics sine{};
        for (std::size_t m = 0; m < harmonic_count; ++m) {
            cosine[m] = std::cos(static_cast<double>(m) * beta);
            sine[m] = std::sin(static_cast<double>(m) * beta);
        }
        const Spectrum light = m_transform.forward(pad_irradiance(m_problem.channels[group.front()]));
        for (std::size_t g = 0; g < group.size(); ++g) {
            const QuadrantKernel kernel(profiles[g][0], m_problem, m_problem.channels[group[g]]);
            accumulate(m_sums[group[g]], light, kernel_spectrum(kernel, cosine, sine));
            m_progress.advance(1.0 / static_cast<double>(group.size()));
        }
    }

    void solve_field(const std::vector<std::size_t>& group, const BeamBasis& basis,
                     const std::vector<std::vector<RadialProfile>>& profiles)
    {
        const Channel& beams = m_problem.channels[group.front()];
        const BeamWeights weights = beam_weights(beams, basis);
        const std::vector<std::size_t> harmonics = needed_harmonics(profiles, m_problem.tolerance);
        const double share = 1.0 / static_cast<double>(basis.node_count() * 2 * harmonics.size());
        for (std::size_t node = 0; node < basis.node_count(); ++node) {
            // One node at a time: the kernels of all of them would take gigabytes.
            std::vector<QuadrantKernel> kernels;
            for (std::size_t g = 0; g < group.size(); ++g)
                kernels.emplace_back(profiles[g][node], m_problem, m_problem.channels[group[g]]);
            for (const std::size_t m : harmonics) {
                for (const Phase phase : {Phase::cosine, Phase::sine}) {
                    if (m == 0 && phase == Phase::sine)
                        continue;
                    const Spectrum light = m_transform.forward(pad_term(beams, weights, {node, m, phase}));
                    Harmonics cosine{};
                    Harmonics sine{};
                    (phase == Phase::cosine ? cosine : sine)[m] = 1.0;
                    for (std::size_t g = 0; g < group.size(); ++g)
                        accumulate(m_sums[group[g]], light, kernel_spectrum(kernels[g], cosine, sine));
                    m_progress.advance(share);
                }
            }
        }
    }

    // For every texel: weights of the nodes for even and odd harmonics, and the azimuth of its beam.
    struct BeamWeights {
        std::vector<float> even;  // [node][texel]
        std::vector<float> odd;
        std::vector<float> beta;  // [texel]
    };

    BeamWeights beam_weights(const Channel& beams, const BeamBasis& basis) const
    {
        const std::size_t texels = m_problem.width * m_problem.height;
        BeamWeights result{std::vector<float>(basis.node_count() * texels),
                           std::vector<float>(basis.node_count() * texels), std::vector<float>(texels)};
        parallel_for(m_problem.height, [&](std::size_t y) {
            for (std::size_t x = 0; x < m_problem.width; ++x) {
                if (beams.irradiance(y, x) == 0.0f)
                    continue;
                const std::size_t texel = y * m_problem.width + x;
                const Vec3 direction = direction_at(m_problem, y, x);
                const BeamBasis::Weights weights = basis.weights(direction);
                for (std::size_t j = 0; j < basis.node_count(); ++j) {
                    result.even[j * texels + texel] = static_cast<float>(weights.even[j]);
                    result.odd[j * texels + texel] = static_cast<float>(weights.odd[j]);
                }
                result.beta[texel] = static_cast<float>(azimuth(direction));
            }
        });
        return result;
    }

    std::vector<double> pad_irradiance(const Channel& beams) const
    {
        std::vector<double> padded(m_transform.height() * m_transform.width(), 0.0);
        for (std::size_t y = 0; y < m_problem.height; ++y)
            for (std::size_t x = 0; x < m_problem.width; ++x)
                padded[y * m_transform.width() + x] = static_cast<double>(beams.irradiance(y, x));
        return padded;
    }

    std::vector<double> pad_term(const Channel& beams, const BeamWeights& weights, const BeamTerm& term) const
    {
        const std::size_t texels = m_problem.width * m_problem.height;
        const std::vector<float>& by_node = term.m % 2 == 0 ? weights.even : weights.odd;
        const auto m = static_cast<double>(term.m);
        std::vector<double> padded = pad_irradiance(beams);
        parallel_for(m_problem.height, [&](std::size_t y) {
            for (std::size_t x = 0; x < m_problem.width; ++x) {
                double& value = padded[y * m_transform.width() + x];
                if (value == 0.0)
                    continue;
                const std::size_t texel = y * m_problem.width + x;
                const double phase = m * static_cast<double>(weights.beta[texel]);
                value *= static_cast<double>(by_node[term.node * texels + texel]) *
                         (term.phase == Phase::cosine ? std::cos(phase) : std::sin(phase));
            }
        });
        return padded;
    }

    Spectrum kernel_spectrum(const QuadrantKernel& kernel, const Harmonics& cosine, const Harmonics& sine) const
    {
        const auto height = static_cast<std::ptrdiff_t>(m_problem.height);
        const auto padded_height = static_cast<std::ptrdiff_t>(m_transform.height());
        std::vector<double> padded(m_transform.height() * m_transform.width(), 0.0);
        parallel_for(2 * m_problem.height - 1, [&](std::size_t i) {
            const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i) - (height - 1);
            std::vector<double> values;
            kernel.row(dy, cosine, sine, values);
            // Offset 0 goes to the first texel, negative ones wrap around to the end.
            double* row =
                padded.data() + static_cast<std::size_t>(dy < 0 ? dy + padded_height : dy) * m_transform.width();
            const auto zero = values.begin() + static_cast<std::ptrdiff_t>(m_problem.width - 1);
            std::copy(zero, values.end(), row);
            std::copy(values.begin(), zero, row + m_transform.width() - (m_problem.width - 1));
        });
        return m_transform.forward(padded);
    }

    void accumulate(Spectrum& sum, const Spectrum& light, const Spectrum& kernel) const
    {
        const std::size_t columns = sum.size() / m_transform.height();
        parallel_for(m_transform.height(), [&](std::size_t row) {
            for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) {
                // The textbook product: std::complex's own handles infinities at ten times the cost.
                const auto a = light[i];
                const auto b = kernel[i];
                sum[i] += std::complex<double>(a.real() * b.real() - a.imag() * b.imag(),
                                               a.real() * b.imag() + a.imag() * b.real());
            }
        });
    }

    std::vector<float> crop(const std::vector<double>& padded) const
    {
        std::vector<float> values(m_problem.width * m_problem.height);
        for (std::size_t y = 0; y < m_problem.height; ++y)
            for (std::size_t x = 0; x < m_problem.width; ++x)
                values[y * m_problem.width + x] = static_cast<float>(inv_pi * padded[y * m_transform.width() + x]);
        return values;
    }

    const Problem& m_problem;
    Progress& m_progress;
    RealTransform m_transform;
    std::vector<Spectrum> m_sums;
};

}  // namespace

Luminance solve_fft(const Problem& problem, Progress& progress)
{
    validate(problem);
    Luminance luminance;
    with_threads(problem.threads, [&] { luminance = Solver(problem, progress).solve(); });
    return luminance;
}

}  // namespace beamspread
