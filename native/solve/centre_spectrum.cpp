#include "solve/centre_spectrum.h"

#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "ldf/texel_integral.h"
#include "solve/gauss_rule.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// 2 pi steps / size; whole turns are left out before they cost digits.
double turn_angle(std::size_t steps, std::size_t size)
{
    return 2.0 * pi * static_cast<double>(steps % size) / static_cast<double>(size);
}

// The integrals over [x0, x0 + px] x [y0, y0 + py] of what lies outside the window, lengths in units of the plane.
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
      m_padded_width(plane.padded_width),
      m_frequencies(plane.padded_height / 2 + 1)
{
    const std::size_t per_profile = harmonic_count * 2 * m_width * m_height;
    m_texels.resize(profiles.size() * per_profile);
    for (std::size_t p = 0; p < profiles.size(); ++p)
        integrate(profiles[p], plane, outside, m_texels.data() + p * per_profile);
    m_trig.resize(2 * m_height * m_frequencies);
    for (std::size_t y = 0; y < m_height; ++y) {
        float* cosine = m_trig.data() + y * m_frequencies;
        float* sine = cosine + m_height * m_frequencies;
        const double twice = y == 0 ? 1.0 : 2.0;
        for (std::size_t f = 0; f < m_frequencies; ++f) {
            const double angle = turn_angle(y * f, plane.padded_height);
            cosine[f] = static_cast<float>(twice * std::cos(angle));
            sine[f] = static_cast<float>(twice * std::sin(angle));
        }
    }
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

void CentreSpectrum::start(std::size_t frequency, Column& column) const
{
    column.cosine.resize(m_width);
    column.sine.resize(m_width);
    for (std::size_t x = 0; x < m_width; ++x) {
        const double twice = x == 0 ? 1.0 : 2.0;
        const double angle = turn_angle(x * frequency, m_padded_width);
        column.cosine[x] = twice * std::cos(angle);
        column.sine[x] = twice * std::sin(angle);
    }
}

std::vector<float> CentreSpectrum::add_up(std::span<const KernelTerm> terms) const
{
    const std::size_t texels = m_width * m_height;
    std::vector<double> sum(texels, 0.0);
    for (const KernelTerm& term : terms) {
        const std::size_t function = term.profile * harmonic_count + term.m;
        const float* kernel = m_texels.data() + (function * 2 + (term.phase == Phase::sine ? 1 : 0)) * texels;
        for (std::size_t i = 0; i < texels; ++i)
            sum[i] += term.weight * static_cast<double>(kernel[i]);
    }
    return {sum.begin(), sum.end()};
}

void CentreSpectrum::spectrum(const Column& column, const std::vector<float>& sum, bool sine, bool odd_m,
                              float* values) const
{
    // A_m is even along x for even m, odd for odd m, and even along y; B_m the other way round. Sums over pairs of
    // odd functions bring factors -i: squared for B_m of even m, once for odd m, where it is left out.
    const std::vector<double>& along_x = odd_m != sine ? column.sine : column.cosine;
    const double sign = sine && !odd_m ? -1.0 : 1.0;
    std::vector<double> rows(m_height, 0.0);
    for (std::size_t x = 0; x < m_width; ++x)
        for (std::size_t y = 0; y < m_height; ++y)
            rows[y] += along_x[x] * static_cast<double>(sum[x * m_height + y]);
    for (std::size_t y = 0; y < m_height; ++y) {
        const float* trig = m_trig.data() + ((sine ? m_height : 0) + y) * m_frequencies;
        const auto factor = static_cast<float>(sign * rows[y]);
        if (y == 0)
            scale(values, trig, factor, m_frequencies);
        else
            add_scaled(values, trig, factor, m_frequencies);
    }
}

}  // namespace beamspread
