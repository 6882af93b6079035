#include "solve/direct/direct.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"
#include "solve/direct/beam_basis.h"

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
std::vector<Term> basis_terms(const Light& light, const std::vector<QuadrantKernel>& kernels)
{
    std::vector<Term> terms;
    const auto* one = std::get_if<OneDirection>(&light.directions);
    if (one != nullptr) {
        Term term{0, {}, {}};
        const double beta = azimuth(one->travel);
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
std::vector<double> beam_factors(const Light& light, const BeamBasis& basis, const std::vector<RadialProfile>& profiles,
                                 const Vec3& direction)
{
    const auto* one = std::get_if<OneDirection>(&light.directions);
    if (one != nullptr)
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

}  // namespace

std::vector<float> solve_direct(const Plane& plane, const Light& light, const ChannelMedium& medium, Progress& progress)
{
    const auto* one = std::get_if<OneDirection>(&light.directions);
    const BeamBasis basis = one != nullptr ? BeamBasis::uniform(one->travel) : BeamBasis::library_nodes(*medium.ldf);
    const std::vector<RadialProfile> profiles = basis.profiles(medium);
    std::vector<QuadrantKernel> kernels;
    for (const RadialProfile& profile : profiles)
        kernels.emplace_back(profile, plane, medium);
    const std::vector<Term> terms = basis_terms(light, kernels);

    const auto height = static_cast<std::ptrdiff_t>(plane.height);
    // rows[(dy + height - 1) * terms + k][dx + width - 1]
    std::vector<KernelRow> rows(static_cast<std::size_t>(2 * height - 1) * terms.size());
    parallel_for(rows.size(), [&](std::size_t i) {
        const Term& term = terms[i % terms.size()];
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(i / terms.size()) - (height - 1);
        kernels[term.node].row(dy, term.cosine, term.sine, rows[i]);
    });

    std::vector<std::vector<Beam>> beams(plane.height);
    parallel_for(plane.height, [&](std::size_t y) {
        for (std::size_t x = 0; x < plane.width; ++x) {
            const auto irradiance = static_cast<double>(light.irradiance(y, x));
            if (irradiance == 0.0)
                continue;
            Beam beam{x, beam_factors(light, basis, profiles, travel_at(plane, light.directions, y, x))};
            for (double& factor : beam.factors)
                factor *= irradiance;
            beams[y].push_back(std::move(beam));
        }
    });

    std::vector<float> luminance(plane.width * plane.height);
    parallel_for(plane.height, [&](std::size_t target) {
        std::vector<double> sum(plane.width, 0.0);
        for (std::size_t source = 0; source < plane.height; ++source) {
            const std::size_t offset = (target + plane.height - 1 - source) * terms.size();
            for (const Beam& beam : beams[source])
                for (std::size_t k = 0; k < terms.size(); ++k)
                    if (beam.factors[k] != 0.0)
                        add_scaled(sum.data(), rows[offset + k].data() + (plane.width - 1 - beam.x), beam.factors[k],
                                   plane.width);
            progress.advance(1.0 / static_cast<double>(plane.height));
        }
        for (std::size_t x = 0; x < plane.width; ++x)
            luminance[target * plane.width + x] = static_cast<float>(inv_pi * sum[x]);
    });
    return luminance;
}

}  // namespace beamspread
