#include "solve/spectral/kernel_spectra.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "fft/fft.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Distance of the transform's samples, in units: half a texel, as the table has the frequencies of texels. At twice,
// the table would end at the Nyquist frequency.
constexpr double sample_step = 0.5;

// Distance in units up to which projections are integrated at every sample, and growth of the distances beyond. Larger
// growth: less time, larger errors around the mirror images of slabs.
constexpr double even_until = 32.0;
constexpr double growth = 1.012;

// Largest phase, in radians, by which the last harmonic turns across a panel; four points integrate it to some 5e-6.
// Larger: less time, larger errors.
constexpr double panel_turn = pi;

// Lagrange's weights of four neighbours at t in [0, 1] between the second and the third.
std::array<double, 4> cubic_weights(double t)
{
    const double a = t + 1.0;
    const double b = t - 1.0;
    const double c = t - 2.0;
    return {-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0};
}

// Distances at which projections are integrated.
std::vector<double> sample_positions(double end)
{
    std::vector<double> positions;
    for (int i = 0; i * sample_step < even_until; ++i)
        positions.push_back(i * sample_step);
    for (int i = 0; positions.back() < std::max(end, 1.1 * even_until) * growth; ++i)
        positions.push_back(even_until * std::pow(growth, i));
    return positions;
}

// Ends of the integrals' panels: steps of a unit across the inner window, of half a deviation across the outer one, and
// halves of the profile's bins.
std::vector<double> panel_breaks(const RadialWindow& window, double to_paths, RadialDetail detail)
{
    const double end = window.end();
    std::vector<double> breaks;
    for (int r = 0; r < std::min(end, 2.0 * window_end * window.inner); ++r)
        breaks.push_back(r);
    const std::vector<double> edges = profile_radii(detail);
    for (std::size_t k = 0; k < edges.size(); ++k) {
        const double r = edges[k] / to_paths;
        const double next = k + 1 < edges.size() ? edges[k + 1] / to_paths : r;
        for (const double edge : {r, 0.5 * (r + next)})
            if (edge > breaks.back() && edge < end)
                breaks.push_back(edge);
    }
    for (int i = 1; 0.5 * i * window.outer < end && window.outer > 0.0; ++i)
        breaks.push_back(0.5 * i * window.outer);
    constexpr int taper_panels = 8;
    for (int i = 0; i < taper_panels && window.taper > 0.0; ++i)
        breaks.push_back(window.cut + window.taper * i / taper_panels);
    breaks.push_back(end);
    std::sort(breaks.begin(), breaks.end());
    return breaks;
}

// Projection onto x: the integral over y of w(r) c_m(r) cos(m phi), with cos(m phi) = T_m(x / r). Panels are divided
// where their harmonics turn by more than `panel_turn`.
Harmonics project(const RadialProfile& profile, const RadialWindow& window, double to_paths,
                  const std::vector<double>& breaks, double x)
{
    Harmonics sum{};
    const auto add = [&](double y0, double y1) {
        for (std::size_t q = 0; q < gauss_node.size(); ++q) {
            const double y = 0.5 * (y0 + y1 + (y1 - y0) * gauss_node[q]);
            const double r = std::hypot(x, y);
            // Twice the weight, for y and -y.
            const double weight = gauss_weight[q] * (y1 - y0) * to_paths * to_paths * window.weight(r);
            const Harmonics c = profile.density(r * to_paths);
            double t0 = 1.0;
            double t1 = x / r;
            for (std::size_t m = 0; m < profile.harmonics(); ++m) {
                sum[m] += weight * c[m] * t0;
                const double t2 = 2.0 * (x / r) * t1 - t0;
                t0 = t1;
                t1 = t2;
            }
        }
    };
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
        if (breaks[k + 1] <= x || breaks[k + 1] - breaks[k] <= 0.0)
            continue;
        const double y0 = breaks[k] > x ? std::sqrt(breaks[k] * breaks[k] - x * x) : 0.0;
        const double y1 = std::sqrt(breaks[k + 1] * breaks[k + 1] - x * x);
        const double turn = static_cast<double>(profile.harmonics()) * (std::atan2(y1, x) - std::atan2(y0, x));
        const int parts = std::max(static_cast<int>(std::ceil(turn / panel_turn)), 1);
        const double step = (y1 - y0) / parts;
        for (int i = 0; i < parts; ++i)
            add(y0 + i * step, y0 + (i + 1) * step);
    }
    return sum;
}

bool has_harmonic(const RadialProfile& profile, std::size_t m)
{
    for (std::size_t k = 0; k < edge_count && m < profile.harmonics(); ++k)
        if (profile.remaining(radial_edge(k))[m] != 0.0)
            return true;
    return false;
}

}  // namespace

HankelTable::HankelTable(const std::vector<ScaledProfile>& profiles, const RadialWindow& window, double unit_m)
{
    const std::size_t samples = static_cast<std::size_t>(std::ceil(window.end() / sample_step)) + 1;
    // Choose the length: neighbours in the table differ in phase by at most 0.2 radians, for long kernels 0.4. Their
    // table would leave the cache, and they have little power at their ends.
    constexpr std::size_t max_short_samples = 2048;
    constexpr std::size_t oversampling = 32;
    const std::size_t length =
        fast_even_size((samples <= max_short_samples ? oversampling : oversampling / 2) * samples);
    m_k_step = 2.0 * pi / (static_cast<double>(length) * sample_step);
    m_column.assign(profiles.size() * harmonic_count, no_column);
    for (std::size_t m = 0; m < harmonic_count; ++m) {
        m_columns_below.push_back(m_columns);
        for (std::size_t p = 0; p < profiles.size(); ++p)
            if (has_harmonic(profiles[p].profile, m))
                m_column[p * harmonic_count + m] = m_columns++;
    }
    m_columns_below.push_back(m_columns);
    m_rows = static_cast<std::size_t>(0.95 * 2.0 * pi / m_k_step) + 4;
    m_table.assign(m_rows * m_columns, 0.0f);
    for (std::size_t p = 0; p < profiles.size(); ++p)
        add_profile(profiles[p], p, window, unit_m, samples, length);
}

// Adds the columns of a profile, by the projection-slice theorem (Bracewell 1956, doi:10.1071/PH560198): the
// two-dimensional transform of c_m(r) cos(m phi) along kx is the one-dimensional transform of its projection onto x.
void HankelTable::add_profile(const ScaledProfile& scaled, std::size_t index, const RadialWindow& window, double unit_m,
                              std::size_t samples, std::size_t length)
{
    const double to_paths = unit_m / scaled.mean_free_path;
    const std::vector<double> breaks = panel_breaks(window, to_paths, scaled.profile.detail());
    const std::vector<double> positions = sample_positions(window.end());
    std::vector<Harmonics> projections(positions.size());
    parallel_for(positions.size(), [&](std::size_t n) {
        projections[n] = project(scaled.profile, window, to_paths, breaks, positions[n]);
    });

    const double log_growth = std::log(growth);
    const auto even_count = static_cast<std::size_t>(even_until / sample_step);
    const auto projection = [&](double x, std::size_t m) {
        if (x < even_until)
            return projections[static_cast<std::size_t>(std::lround(x / sample_step))][m];
        const double position = std::log(x / even_until) / log_growth;
        const auto i =
            std::clamp<std::size_t>(static_cast<std::size_t>(position), 1, positions.size() - even_count - 3);
        const auto w = cubic_weights(position - static_cast<double>(i));
        double value = 0.0;
        for (std::size_t j = 0; j < 4; ++j)
            value += w[j] * projections[even_count + i - 1 + j][m];
        return value;
    };
    parallel_for(scaled.profile.harmonics(), [&](std::size_t m) {
        if (column(index, m) == no_column)
            return;
        std::vector<float> line(length, 0.0f);
        for (std::size_t n = 0; n < samples; ++n)
            line[n] = static_cast<float>(2.0 * sample_step * projection(static_cast<double>(n) * sample_step, m));
        line[0] *= 0.5f;
        std::vector<Complex> half(length / 2 + 1);
        fft().real_to_half(line.data(), half.data(), 1, length);
        float* values = m_table.data() + column(index, m);
        for (std::size_t i = 0; i + 3 < m_rows; ++i)
            values[(i + 1) * m_columns] = m % 2 == 0 ? half[i].real() : -half[i].imag();
        values[0] = m % 2 == 0 ? values[2 * m_columns] : -values[2 * m_columns];
    });
}

void HankelTable::row(double k, std::size_t first, std::size_t count, float* values) const
{
    const double position = k / m_k_step;
    const std::size_t row = std::min(static_cast<std::size_t>(position), m_rows - 4);
    const auto w = cubic_weights(std::min(position - static_cast<double>(row), 1.0));
    const std::array<float, 4> weights = {static_cast<float>(w[0]), static_cast<float>(w[1]), static_cast<float>(w[2]),
                                          static_cast<float>(w[3])};
    interpolate(values, m_table.data() + row * m_columns + first, m_columns, weights.data(), count);
}

}  // namespace beamspread
