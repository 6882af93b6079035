#include "solve/term_choice/probe_tables.h"

#include "base/threads.h"
#include "ldf/radial/texel_integral.h"

namespace beamspread {

namespace {

// A quadrant of texels around a beam.
TexelIntegrals integrate_quadrant(const ScaledProfile& scaled, double pitch_x, double pitch_y, std::size_t size)
{
    const double px = pitch_x / scaled.mean_free_path;
    const double py = pitch_y / scaled.mean_free_path;
    return integrate_texels(scaled.profile, {-0.5 * px, -0.5 * py, px, py, size, size});
}

}  // namespace

ProbeTables::ProbeTables(const LowRankBasis& basis, double pitch_x, double pitch_y, std::size_t height,
                         std::size_t width)
    : m_pitch_x(pitch_x),
      m_pitch_y(pitch_y),
      m_unit(std::min(pitch_x, pitch_y)),
      m_media(basis.profiles.size()),
      m_ranks(basis.profiles.front().size()),
      m_first(static_cast<float>(basis.first)),
      m_per_step(basis.last > basis.first ? static_cast<float>(angle_steps / (basis.last - basis.first)) : 0.0f)
{
    std::vector<std::size_t> harmonics(m_ranks, 1);  // m = 0 has a place in every row
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        harmonics[function.rank] = std::max(harmonics[function.rank], function.m + 1);
    m_starts.push_back(0);
    for (const std::size_t count : harmonics) {
        const std::size_t padded = (count + harmonics_per_block - 1) / harmonics_per_block * harmonics_per_block;
        for (std::size_t m = 0; m < padded; m += harmonics_per_block)
            m_columns.push_back(m);
        m_starts.push_back(m_starts.back() + padded);
        m_harmonics = std::max(m_harmonics, padded);
    }
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        m_places.push_back(m_starts[function.rank] + function.m);
    tabulate_angles(basis);
    tabulate_radii(basis, std::hypot(static_cast<double>(width) * pitch_x, static_cast<double>(height) * pitch_y));
    tabulate_turns();
    integrate_near(basis);
    integrate_nearby(basis);
}

void ProbeTables::tabulate_angles(const LowRankBasis& basis)
{
    m_by_angle.resize(angle_steps * functions());
    for (std::size_t step = 0; step < angle_steps; ++step)
        for (std::size_t f = 0; f < m_places.size(); ++f) {
            const std::vector<TableStep>& values = basis.functions[f].values;
            m_by_angle[step * functions() + m_places[f]] =
                values[(2 * step + 1) * (values.size() - 1) / (2 * angle_steps)].value;
        }
}

void ProbeTables::tabulate_radii(const LowRankBasis& basis, double longest)
{
    double reach = 0.0;
    for (const std::vector<ScaledProfile>& profiles : basis.profiles)
        reach = std::max(reach, profiles.front().reach);
    constexpr auto per_octave = static_cast<double>(radius_steps);
    const double octaves = std::log2(std::max(std::min(reach, longest) / m_unit, 1.0));
    const std::size_t radii = static_cast<std::size_t>(std::ceil(octaves * per_octave)) + 1;
    m_end_squared = static_cast<float>(std::exp2(2.0 * static_cast<double>(radii) / per_octave));
    m_by_radius.resize(radii * m_media * functions());
    parallel_for(radii, [&](std::size_t step) {
        const double r = m_unit * std::exp2((static_cast<double>(step) + 0.5) / per_octave);
        for (std::size_t k = 0; k < m_media; ++k)
            for (std::size_t rank = 0; rank < m_ranks; ++rank) {
                const ScaledProfile& scaled = basis.profiles[k][rank];
                const double path = scaled.mean_free_path;
                if (r > scaled.reach)
                    continue;
                const Harmonics density = scaled.profile.density(r / path);
                float* values = m_by_radius.data() + (step * m_media + k) * functions();
                for (std::size_t i = m_starts[rank]; i < m_starts[rank + 1]; ++i)
                    values[i] = static_cast<float>(m_pitch_x * m_pitch_y / (path * path) * density[i - m_starts[rank]]);
            }
    });
}

// Where beams on one side of a square are seen turned by 2 w from those on the other, the mean of a harmonic is by about
// sin(m w) / (m w) smaller, of which this is the envelope: what is left where light ends.
void ProbeTables::tabulate_turns()
{
    m_by_turn.resize(turn_steps * m_harmonics);
    for (std::size_t step = 0; step < turn_steps; ++step) {
        const float half_turn = 0.5f * (static_cast<float>(step) + 0.5f) / turn_steps_per_radian;
        for (std::size_t m = 0; m < m_harmonics; ++m) {
            const float turned = half_turn * static_cast<float>(m);
            m_by_turn[step * m_harmonics + m] = 1.0f / std::sqrt(1.0f + turned * turned);
        }
    }
}

void ProbeTables::integrate_near(const LowRankBasis& basis)
{
    constexpr std::size_t size = squares_between + 1;
    m_near.resize(size * size * 2 * m_media * functions());
    parallel_for(m_media * m_ranks, [&](std::size_t item) {
        const TexelIntegrals integrals =
            integrate_quadrant(basis.profiles[item / m_ranks][item % m_ranks], m_pitch_x, m_pitch_y, size);
        const std::size_t rank = item % m_ranks;
        const std::size_t harmonics = m_starts[rank + 1] - m_starts[rank];
        for (std::size_t texel = 0; texel < size * size; ++texel) {
            float* cosine = m_near.data() + (2 * texel * m_media + item / m_ranks) * functions() + m_starts[rank];
            float* sine = cosine + m_media * functions();
            for (std::size_t m = 0; m < std::min(harmonics, integrals.harmonics); ++m) {
                cosine[m] = static_cast<float>(integrals.cosine[m * size * size + texel]);
                sine[m] = static_cast<float>(integrals.sine[m * size * size + texel]);
            }
        }
    });
}

void ProbeTables::integrate_nearby(const LowRankBasis& basis)
{
    constexpr std::size_t size = nearby_size;
    const std::size_t ranks = nearby_ranks();
    m_nearby.resize(m_media * ranks * size * size);
    parallel_for(m_media * ranks, [&](std::size_t item) {
        const ScaledProfile& scaled = basis.profiles[item / ranks][item % ranks];
        ScaledProfile power{RadialProfile(), scaled.mean_free_path};
        Harmonics only{};
        only[0] = 1.0;
        power.profile.add(scaled.profile, only);
        constexpr std::size_t quadrant = nearby_reach + nearby_side;
        const TexelIntegrals integrals = integrate_quadrant(power, m_pitch_x, m_pitch_y, quadrant);
        // At places in the table, from the texel (y0, x0) of the square.
        const auto integral = [&](std::size_t y, std::size_t x, std::size_t y0, std::size_t x0) {
            return integrals.cosine[distance(y, nearby_reach + 1 + y0) * quadrant + distance(x, nearby_reach + 1 + x0)];
        };
        double* sums = m_nearby.data() + item * size * size;
        for (std::size_t y = 1; y < size; ++y)
            for (std::size_t x = 1; x < size; ++x) {
                double mean = 0.0;
                for (std::size_t i = 0; i < nearby_side * nearby_side; ++i)
                    mean += integral(y, x, i / nearby_side, i % nearby_side) / (nearby_side * nearby_side);
                sums[y * size + x] =
                    mean + sums[(y - 1) * size + x] + sums[y * size + x - 1] - sums[(y - 1) * size + x - 1];
            }
    });
}

}  // namespace beamspread
