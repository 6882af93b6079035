#include "solve/direct/direct.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/threads.h"
#include "ldf/radial/radial_function.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// A sum of some of the kernels A_jm and B_jm (g of Manabe et al. 2012, Eq. 2, in azimuthal harmonics), texel integrals
// of c_jm(r) cos(m phi) and c_jm(r) sin(m phi). The kernel of a beam at (theta, beta) is the sum over nodes j and
// harmonics m of
//   weight_j,m(theta) [cos(m beta) A_jm + sin(m beta) B_jm].
struct Term {
    std::size_t node;
    Harmonics cosine{};
    Harmonics sine{};
};

// The terms with kernels of their own: one for a uniform direction, else one for each node, harmonic and phase.
std::vector<Term> basis_terms(const OneDirection* uniform, const std::vector<RadialProfile>& profiles)
{
    std::vector<Term> terms;
    if (uniform != nullptr) {
        Term term{0, {}, {}};
        const double beta = azimuth(uniform->travel);
        for (std::size_t m = 0; m < profiles[0].harmonics(); ++m) {
            term.cosine[m] = std::cos(static_cast<double>(m) * beta);
            term.sine[m] = std::sin(static_cast<double>(m) * beta);
        }
        return {term};
    }
    for (std::size_t j = 0; j < profiles.size(); ++j) {
        for (std::size_t m = 0; m < profiles[j].harmonics(); ++m) {
            terms.emplace_back(Term{j, {}, {}}).cosine[m] = 1.0;
            if (m > 0)
                terms.emplace_back(Term{j, {}, {}}).sine[m] = 1.0;
        }
    }
    return terms;
}

struct Beam {
    std::size_t x;
    double irradiance;
    double cos_beta;
    double sin_beta;
    LdfSource::AngleWeights weights;  // of the nodes; empty for a uniform direction
};

// Beams of the lit texels of each row.
std::vector<std::vector<Beam>> beam_rows(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                         Progress& progress)
{
    std::vector<std::vector<Beam>> rows(plane.height);
    const bool uniform = std::holds_alternative<OneDirection>(light.directions);
    parallel_for(plane.height, [&](std::size_t y) {
        for (std::size_t x = 0; x < plane.width; ++x) {
            const auto irradiance = static_cast<double>(light.irradiance(y, x));
            if (irradiance == 0.0)
                continue;
            const Vec3 direction = travel_at(plane, light.directions, y, x);
            const double beta = azimuth(direction);
            rows[y].push_back({x, irradiance, std::cos(beta), std::sin(beta), {}});
            if (!uniform)
                rows[y].back().weights = medium.ldf->angle_weights(incidence_deg(direction), medium.side);
        }
        progress.advance(0.0);
    });
    return rows;
}

// Computes the irradiance of a beam times the factors of its terms, in the order of basis_terms.
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

// A term's kernel for the row offset dy and dx = -(width - 1) .. width - 1. `quadrant` has the texel integrals of row
// offsets from `first` and column offsets 0 .. width - 1 from the beam's texel; other quadrants follow by symmetry.
std::vector<double> kernel_row(const TexelIntegrals& quadrant, const Term& term, std::size_t first, std::size_t width,
                               std::ptrdiff_t dy)
{
    std::vector<double> values(2 * width - 1, 0.0);
    double* right = values.data() + (width - 1);
    const std::size_t start = (static_cast<std::size_t>(std::abs(dy)) - first) * width;
    for (std::size_t m = 0; m < quadrant.harmonics; ++m) {
        const std::size_t index = m * (quadrant.cosine.size() / quadrant.harmonics) + start;
        // phi -> -phi for dy < 0, and phi -> pi - phi for dx < 0.
        const double by_sine = dy < 0 ? -term.sine[m] : term.sine[m];
        const double mirrored = m % 2 == 0 ? 1.0 : -1.0;
        const auto add = [&](double factor, const double* integrals, double to_the_left) {
            if (factor == 0.0)
                return;
            for (std::size_t x = 0; x < width; ++x)
                right[x] += factor * integrals[x];
            for (std::size_t x = 1; x < width; ++x)
                values[width - 1 - x] += to_the_left * factor * integrals[x];
        };
        add(term.cosine[m], quadrant.cosine.data() + index, mirrored);
        add(by_sine, quadrant.sine.data() + index, -mirrored);
    }
    return values;
}

// Kernels of all terms for the row offsets first .. first + count - 1 and the opposite ones.
class KernelRows {
public:
    KernelRows(const Plane& plane, const ChannelMedium& medium, const std::vector<RadialProfile>& profiles,
               const std::vector<Term>& terms, std::size_t first, std::size_t count, Progress& progress)
        : m_first(first), m_terms(terms.size()), m_rows(2 * count * m_terms)
    {
        const double px = plane.pitch_x / medium.mean_free_path;
        const double py = plane.pitch_y / medium.mean_free_path;
        const double y0 = (static_cast<double>(first) - 0.5) * py;
        std::vector<TexelIntegrals> nodes(profiles.size());
        parallel_for(nodes.size(), [&](std::size_t j) {
            nodes[j] = integrate_texels(profiles[j], {-0.5 * px, y0, px, py, plane.width, count});
            progress.advance(0.0);
        });
        parallel_for(m_rows.size(), [&](std::size_t i) {
            const Term& term = terms[i % m_terms];
            const auto dy = static_cast<std::ptrdiff_t>(first + i / m_terms / 2);
            m_rows[i] = kernel_row(nodes[term.node], term, first, plane.width, i / m_terms % 2 == 0 ? dy : -dy);
            progress.advance(0.0);
        });
    }

    // Kernels of light `dy` rows below or above: one row per term, dx = -(width - 1) .. width - 1.
    const std::vector<double>* below(std::size_t dy) const { return m_rows.data() + 2 * (dy - m_first) * m_terms; }
    const std::vector<double>* above(std::size_t dy) const { return below(dy) + m_terms; }

private:
    std::size_t m_first;
    std::size_t m_terms;
    std::vector<std::vector<double>> m_rows;
};

// Number of row offsets with kernels in memory. The limit on bytes keeps memory from growing with the square of the
// plane's size; neighbouring rows share the borders of their texels. Larger limit: less time, more memory.
std::size_t rows_at_once(std::size_t terms, std::size_t width)
{
    constexpr std::size_t max_bytes = std::size_t{1} << 26;
    return std::max<std::size_t>(max_bytes / (2 * terms * 2 * width * sizeof(double)), 1);
}

}  // namespace

std::vector<double> solve_direct(const Plane& plane, const PlaneLight& light, const ChannelMedium& medium,
                                 Progress& progress)
{
    const auto* uniform = std::get_if<OneDirection>(&light.directions);
    const LdfSource& ldf = *medium.ldf;
    const std::vector<RadialProfile> profiles =
        uniform != nullptr ? std::vector{ldf.profile(incidence_deg(uniform->travel), medium.albedo, medium.side)}
                           : ldf.node_profiles(medium.albedo, medium.side);
    const std::vector<Term> terms = basis_terms(uniform, profiles);
    // Progress of one pair of rows.
    const double work = 1.0 / (static_cast<double>(plane.height) * static_cast<double>(plane.height));
    const std::vector<std::vector<Beam>> beams = beam_rows(plane, light, medium, progress);

    std::vector<double> sum(plane.width * plane.height);
    const auto add_row = [&](std::size_t target, std::size_t source, const std::vector<double>* kernels) {
        std::vector<double> factors(terms.size());
        for (const Beam& beam : beams[source]) {
            find_factors(beam, profiles, uniform != nullptr, factors.data());
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
    return sum;
}

}  // namespace beamspread
