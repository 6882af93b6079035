// The direct solver: one beam per lit texel, one kernel value per pair of texels.
#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"
#include "solve/direct/beam_basis.h"
#include "solve/problem/directions.h"

namespace beamspread {

namespace {

// Values of one basis kernel for one row offset, dx = -(width - 1) .. width - 1.
using KernelRow = std::vector<double>;

struct Term {
    std::size_t node;
    Harmonics cosine{};
    Harmonics sine{};
};

// The combinations of node, harmonic and phase whose kernels are kept apart: one for a uniform direction.
std::vector<Term> basis_terms(const Problem& problem, const std::vector<QuadrantKernel>& kernels)
{
    std::vector<Term> terms;
    if (!problem.directions.field) {
        Term term{0, {}, {}};
        const double beta = azimuth(problem.directions.uniform);
        for (std::size_t m = 0; m < kernels[0].harmonics(); ++m) {
            term.cosine[m] = std::cos(static_cast<double>(m) * beta);
            term.sine[m] = std::sin(static_cast<double>(m) * beta);
        }
        return {term};
    }
    for (std::size_t j = 0; j < kernels.size(); ++j) {
        for (std::size_t m = 0; m < kernels[j].harmonics(); ++m) {
            Term cosine{j, {}, {}};
            cosine.cosine[m] = 1.0;
            terms.push_back(cosine);
            if (m == 0)
                continue;
            Term sine{j, {}, {}};
            sine.sine[m] = 1.0;
            terms.push_back(sine);
        }
    }
    return terms;
}

// Factors of the terms for the beam at one texel, in the order of basis_terms.
std::vector<double> beam_factors(const Problem& problem, const BeamBasis& basis,
                                 const std::vector<RadialProfile>& profiles, const Vec3& direction)
{
    if (!problem.directions.field)
        return {1.0};
    const BeamBasis::Weights weights = basis.weights(direction);
    const std::size_t harmonics = weights.harmonics(profiles);
    const double beta = azimuth(direction);
    std::vector<double> factors;
    for (std::size_t j = 0; j < profiles.size(); ++j) {
        for (std::size_t m = 0; m < profiles[j].harmonics(); ++m) {
            const double weight = m >= harmonics ? 0.0 : m % 2 == 0 ? weights.even[j] : weights.odd[j];
            factors.push_back(weight * std::cos(static_cast<double>(m) * beta));
            if (m > 0)
                factors.push_back(weight * std::sin(static_cast<double>(m) * beta));
        }
    }
    return factors;
}

struct Beam {
    std::size_t x;
    std::vector<double> factors;  // irradiance included
};

std::vector<float> solve_channel(const Problem& problem, const Channel& channel, Progress& progress)
{
    const BeamBasis basis =
        problem.directions.field ? BeamBasis::library_nodes(*channel.library) : BeamBasis::uniform(problem);
    const std::vector<RadialProfile> profiles = basis.profiles(channel);
    std::vector<QuadrantKernel> kernels;
    for (const RadialProfile& profile : profiles)
        kernels.emplace_back(profile, problem, channel);
    const std::vector<Term> terms = basis_terms(problem, kernels);

    const auto height = static_cast<std::ptrdiff_t>(problem.height);
    // rows[(dy + height - 1) * terms + k][dx + width - 1]
    std::vector<KernelRow> rows(static_cast<std::size_t>(2 * height - 1) * terms.size());
    parallel_for(rows.size(), [&](std::size_t i) {
        const Term& term = terms[i % terms.size()];
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i / terms.size()) - (height - 1);
        kernels[term.node].row(dy, term.cosine, term.sine, rows[i]);
    });

    std::vector<std::vector<Beam>> beams(problem.height);
    parallel_for(problem.height, [&](std::size_t y) {
        for (std::size_t x = 0; x < problem.width; ++x) {
            const auto irradiance = static_cast<double>(channel.irradiance(y, x));
            if (irradiance == 0.0)
                continue;
            Beam beam{x, beam_factors(problem, basis, profiles, direction_at(problem, y, x))};
            for (double& factor : beam.factors)
                factor *= irradiance;
            beams[y].push_back(std::move(beam));
        }
    });

    std::vector<float> luminance(problem.width * problem.height);
    parallel_for(problem.height, [&](std::size_t target) {
        std::vector<double> sum(problem.width, 0.0);
        for (std::size_t source = 0; source < problem.height; ++source) {
            const std::size_t offset = (target + problem.height - 1 - source) * terms.size();
            for (const Beam& beam : beams[source])
                for (std::size_t k = 0; k < terms.size(); ++k)
                    if (beam.factors[k] != 0.0)
                        add_scaled(sum.data(), rows[offset + k].data() + (problem.width - 1 - beam.x), beam.factors[k],
                                   problem.width);
            progress.advance(1.0 / static_cast<double>(problem.height));
        }
        for (std::size_t x = 0; x < problem.width; ++x)
            luminance[target * problem.width + x] = static_cast<float>(inv_pi * sum[x]);
    });
    return luminance;
}

}  // namespace

Luminance solve_direct(const Problem& problem, Progress& progress)
{
    validate(problem);
    progress.set_total(static_cast<double>(problem.height * problem.channels.size()));
    Luminance luminance;
    with_threads(problem.threads, [&] {
        for (const Channel& channel : problem.channels)
            luminance.push_back(solve_channel(problem, channel, progress));
    });
    progress.finish();
    return luminance;
}

}  // namespace beamspread
