#include "solve/spectral/kernel_spectra.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "ldf/radial/radial_function.h"
#include "simd/loops.h"

namespace beamspread {

namespace {

// Phase 2 pi steps / size, without whole turns, which would lose digits.
double phase_of(std::size_t steps, std::size_t size)
{
    return 2.0 * pi * static_cast<double>(steps % size) / static_cast<double>(size);
}

// Integrals over the texel [x0, x0 + px] x [y0, y0 + py] of the kernel outside the window. Lengths are in the plane's
// unit.
struct RingIntegrals {
    Harmonics cosine{};
    Harmonics sine{};
};

RingIntegrals integrate_ring(const RadialProfile& profile, const RadialWindow& outside, double to_paths, double x0,
                             double y0, double px, double py)
{
    RingIntegrals sum;
    for (std::size_t i = 0; i < gauss_node.size() * gauss_node.size(); ++i) {
        const std::size_t ix = i % gauss_node.size();
        const std::size_t iy = i / gauss_node.size();
        const double x = x0 + 0.5 * px * (1.0 + gauss_node[ix]);
        const double y = y0 + 0.5 * py * (1.0 + gauss_node[iy]);
        const double r = std::hypot(x, y);
        const Harmonics c = profile.density(r * to_paths);
        const double weight =
            0.25 * px * py * gauss_weight[ix] * gauss_weight[iy] * to_paths * to_paths * outside.weight(r);
        double cos_m_phi = weight;
        double sin_m_phi = 0.0;
        for (std::size_t m = 0; m < profile.harmonics(); ++m) {
            sum.cosine[m] += c[m] * cos_m_phi;
            sum.sine[m] += c[m] * sin_m_phi;
            const double next = (cos_m_phi * x - sin_m_phi * y) / r;
            sin_m_phi = (sin_m_phi * x + cos_m_phi * y) / r;
            cos_m_phi = next;
        }
    }
    return sum;
}

}  // namespace

CentreSpectrum::CentreSpectrum(const PaddedPlane& plane, const KernelCentre& half_width,
                               const std::vector<ScaledProfile>& profiles, const std::optional<RadialWindow>& outside)
    : m_width(half_width.x + 1),
      m_height(half_width.y + 1),
      m_stride((m_height + values_per_block - 1) / values_per_block * values_per_block),
      m_padded_width(plane.padded_width),
      m_padded_height(plane.padded_height),
      m_frequencies(plane.padded_height / 2 + 1)
{
    const std::size_t per_profile = harmonic_count * 2 * m_width * m_height;
    m_texels.resize(profiles.size() * per_profile);
    for (std::size_t p = 0; p < profiles.size(); ++p)
        integrate(profiles[p], plane, outside, m_texels.data() + p * per_profile);
}

void CentreSpectrum::integrate(const ScaledProfile& scaled, const PaddedPlane& plane,
                               const std::optional<RadialWindow>& outside, float* kernels) const
{
    const std::size_t texels = m_width * m_height;
    const double px = plane.pitch_x / plane.unit();
    const double py = plane.pitch_y / plane.unit();
    const double to_paths = plane.unit() / scaled.mean_free_path;
    const TexelIntegrals exact = integrate_texels(
        scaled.profile, {-0.5 * px * to_paths, -0.5 * py * to_paths, px * to_paths, py * to_paths, m_width, m_height});
    parallel_for(texels, [&](std::size_t texel) {
        const std::size_t row = texel / m_width;
        const double x0 = (static_cast<double>(texel % m_width) - 0.5) * px;
        const double y0 = (static_cast<double>(row) - 0.5) * py;
        const RingIntegrals ring =
            outside ? integrate_ring(scaled.profile, *outside, to_paths, x0, y0, px, py) : RingIntegrals();
        for (std::size_t m = 0; m < scaled.profile.harmonics(); ++m) {
            float* kernel = kernels + m * 2 * texels + texel % m_width * m_height + row;
            kernel[0] = static_cast<float>(exact.cosine[m * texels + texel] - ring.cosine[m]);
            kernel[texels] = static_cast<float>(exact.sine[m * texels + texel] - ring.sine[m]);
        }
    });
}

CentreSpectrum::Sum CentreSpectrum::add_up(std::span<const KernelTerm> terms) const
{
    Sum sum{std::vector<float>(m_width * m_stride), terms.front().phase == Phase::sine, terms.front().m % 2 == 1};
    // A_m is even along y, and along x even for even m and odd for odd m; B_m has the opposite parities. Each odd axis
    // brings a factor -i: squared for B_m of even m, and once for odd m, where the spectrum omits it.
    const double sign = sum.sine && !sum.odd_m ? -1.0 : 1.0;
    std::vector<double> column(m_height);
    for (std::size_t x = 0; x < m_width; ++x) {
        std::fill(column.begin(), column.end(), 0.0);
        for (const KernelTerm& term : terms) {
            const std::size_t function = 2 * (term.profile * harmonic_count + term.m) + (sum.sine ? 1 : 0);
            const float* kernel = m_texels.data() + (function * m_width + x) * m_height;
            for (std::size_t y = 0; y < m_height; ++y)
                column[y] += sign * term.weight * static_cast<double>(kernel[y]);
        }
        std::copy(column.begin(), column.end(), sum.texels.begin() + static_cast<std::ptrdiff_t>(x * m_stride));
    }
    return sum;
}

void CentreSpectrum::start(std::size_t first_frequency, std::size_t count, Columns& columns) const
{
    columns.count = count;
    columns.cosine.resize(count * m_width);
    columns.sine.resize(count * m_width);
    for (std::size_t i = 0; i < count * m_width; ++i) {
        const std::size_t x = i % m_width;
        const double twice = x == 0 ? 1.0 : 2.0;
        const double angle = phase_of(x * (first_frequency + i / m_width), m_padded_width);
        columns.cosine[i] = static_cast<float>(twice * std::cos(angle));
        columns.sine[i] = static_cast<float>(twice * std::sin(angle));
    }
    columns.rows.resize(columns.sums.size() * count * m_stride);
    for (std::size_t i = 0; i < columns.sums.size(); ++i) {
        const Sum& sum = *columns.sums[i];
        const std::vector<float>& along_x = sum.odd_m != sum.sine ? columns.sine : columns.cosine;
        multiply_rows(columns.rows.data() + i * count * m_stride, along_x.data(), sum.texels.data(), count, m_width,
                      m_stride);
    }
}

void CentreSpectrum::spectra(Columns& columns, std::size_t column, std::size_t first, std::size_t count,
                             float* values) const
{
    columns.half.resize(lines_at_once * m_frequencies);
    for (const std::size_t end = first + count; first < end; first += lines_at_once) {
        const std::size_t lines = std::min(lines_at_once, end - first);
        columns.lines.assign(lines_at_once * m_padded_height, 0.0f);
        for (std::size_t i = 0; i < lines; ++i) {
            const float* rows = columns.rows.data() + ((first + i) * columns.count + column) * m_stride;
            float* line = columns.lines.data() + i * m_padded_height;
            line[0] = rows[0];
            std::transform(rows + 1, rows + m_height, line + 1, [](float row) { return 2.0f * row; });
        }
        fft().real_to_half(columns.lines.data(), columns.half.data(), lines, m_padded_height);
        for (std::size_t i = 0; i < lines; ++i) {
            const Complex* half = columns.half.data() + i * m_frequencies;
            const bool sine = columns.sums[first + i]->sine;
            values = std::transform(half, half + m_frequencies, values,
                                    [sine](const Complex& z) { return sine ? -z.imag() : z.real(); });
        }
    }
}

}  // namespace beamspread
