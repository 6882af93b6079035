#include "solve/direct/direct.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "simd/loops.h"
#include "solve/direct/beam_basis.h"

namespace beamspread {

namespace {

struct Term {
    std::size_t node;
    Harmonics cosine{};
    Harmonics sine{};
};

// The combinations of node, harmonic and phase whose kernels are kept apart: one for a uniform direction.
std::vector<Term> basis_terms(const OneDirection* one, const std::vector<RadialProfile>& profiles)
{
    std::vector<Term> terms;
    if (one != nullptr) {
        Term term{0, {}, {}};
        const double beta = azimuth(one->travel);
        for (std::size_t m = 0; m < profiles[0].harmonics(); ++m) {
            term.cosine[m] = std::cos(static_cast<double>(m) * beta);
            term.sine[m] = std::sin(static_cast<double>(m) * beta);
        }
        return {term};
    }
    for (std::size_t j = 0; j < profiles.size(); ++j) {
        for (std::size_t m = 0; m < profiles[j].harmonics(); ++m) {
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

struct Beam {
    std::size_t x;
    double irradiance;
    double cos_beta;
    double sin_beta;
    BeamBasis::Weights weights;
};

// The lit texels of each row.
std::vector<std::vector<Beam>> beam_rows(const Plane& plane, const PlaneLight& light, const BeamBasis& basis,
                                         Progress& progress)
{
    std::vector<std::vector<Beam>> rows(plane.height);
    parallel_for(plane.height, [&](std::size_t y) {
        for (std::size_t x = 0; x < plane.width; ++x) {
            const auto irradiance = static_cast<double>(light.irradiance(y, x));
            if (irradiance == 0.0)
                continue;
            const Vec3 direction = travel_at(plane, light.directions, y, x);
            const double beta = azimuth(direction);
            rows[y].push_back({x, irradiance, std::cos(beta), std::sin(beta), basis.weights(direction)});
        }
        progress.advance(0.0);
    });
    return rows;
}

// Irradiance times the factors of the terms for one beam, in the order of basis_terms.
void find_factors(const Beam& beam, const std::vector<RadialProfile>& profiles, bool uniform, double* factor)
{
    if (uniform) {
        *factor = beam.irradiance;
        return;
    }
    const std::size_t harmonics = beam.weights.harmonics(profiles);
    Harmonics cosine{beam.irradiance};  // times cos(m beta), sin(m beta)
    Harmonics sine{};
    for (std::size_t m = 1; m < harmonics; ++m) {
        cosine[m] = cosine[m - 1] * beam.cos_beta - sine[m - 1] * beam.sin_beta;
        sine[m] = sine[m - 1] * beam.cos_beta + cosine[m - 1] * beam.sin_beta;
    }
    for (std::size_t j = 0; j < profiles.size(); ++j) {
        const std::array<double, 2> weights{beam.weights.even[j], beam.weights.odd[j]};
        for (std::size_t m = 0; m < profiles[j].harmonics(); ++m) {
            *factor++ = weights[m % 2] * cosine[m];
            if (m > 0)
                *factor++ = weights[m % 2] * sine[m];
        }
    }
}

// Kernels of all terms for the row offsets first .. first + count - 1 and the opposite ones.
class KernelRows {
public:
    KernelRows(const Plane& plane, const ChannelMedium& medium, const std::vector<RadialProfile>& profiles,
               const std::vector<Term>& terms, std::size_t first, std::size_t count, Progress& progress)
        : m_first(first), m_terms(terms.size()), m_rows(2 * count * m_terms)
    {
        std::vector<QuadrantRows> nodes(profiles.size());
        parallel_for(nodes.size(), [&](std::size_t j) {
            nodes[j] = QuadrantRows(profiles[j], plane, medium, first, count);
            progress.advance(0.0);
        });
        parallel_for(m_rows.size(), [&](std::size_t i) {
            const Term& term = terms[i % m_terms];
            const auto dy = static_cast<std::ptrdiff_t>(first + i / m_terms / 2);
            nodes[term.node].row(i / m_terms % 2 == 0 ? dy : -dy, term.cosine, term.sine, m_rows[i]);
            progress.advance(0.0);
        });
    }

    // One row per term, dx = -(width - 1) .. width - 1, for the light of a row `dy` rows below or above.
    const std::vector<double>* below(std::size_t dy) const { return m_rows.data() + 2 * (dy - m_first) * m_terms; }
    const std::vector<double>* above(std::size_t dy) const { return below(dy) + m_terms; }

private:
    std::size_t m_first;
    std::size_t m_terms;
    std::vector<std::vector<double>> m_rows;
};

// Row offsets whose kernels are kept at a time: of up to 64 MB, so that memory does not grow with the square of the
// plane's size, and up to 16, which share the borders of their texels.
std::size_t rows_at_once(std::size_t terms, std::size_t width)
{
    constexpr std::size_t bytes = std::size_t{1} << 26;
    return std::clamp<std::size_t>(bytes / (2 * terms * 2 * width * sizeof(double)), 1, 16);
}

}  // namespace

std::vector<float> solve_direct(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                Progress& progress)
{
    const auto* one = std::get_if<OneDirection>(&light.directions);
    const BeamBasis basis = one != nullptr ? BeamBasis::uniform(one->travel) : BeamBasis::library_nodes(*medium.ldf);
    const std::vector<RadialProfile> profiles = basis.profiles(medium);
    const std::vector<Term> terms = basis_terms(one, profiles);
    // Every row lights every row.
    const double work = 1.0 / (static_cast<double>(plane.height) * static_cast<double>(plane.height));
    const std::vector<std::vector<Beam>> beams = beam_rows(plane, light, basis, progress);

    std::vector<double> sum(plane.width * plane.height);
    const auto add_row = [&](std::size_t target, std::size_t source, const std::vector<double>* kernels) {
        std::vector<double> factors(terms.size());
        for (const Beam& beam : beams[source]) {
            find_factors(beam, profiles, one != nullptr, factors.data());
            for (std::size_t k = 0; k < factors.size(); ++k)
                if (factors[k] != 0.0)
                    add_scaled(sum.data() + target * plane.width, kernels[k].data() + (plane.width - 1 - beam.x),
                               factors[k], plane.width);
        }
        progress.advance(work);
    };
    const std::size_t at_once = rows_at_once(terms.size(), plane.width);
    for (std::size_t first = 0; first < plane.height; first += at_once) {
        const std::size_t end = std::min(plane.height, first + at_once);
        const KernelRows rows(plane, medium, profiles, terms, first, end - first, progress);
        parallel_for(plane.height, [&](std::size_t target) {
            for (std::size_t dy = first; dy < end; ++dy) {
                if (dy <= target)
                    add_row(target, target - dy, rows.below(dy));
                if (dy > 0 && target + dy < plane.height)
                    add_row(target, target + dy, rows.above(dy));
            }
        });
    }
    std::vector<float> luminance(sum.size());
    std::transform(sum.begin(), sum.end(), luminance.begin(),
                   [](double value) { return static_cast<float>(inv_pi * value); });
    return luminance;
}

}  // namespace beamspread
