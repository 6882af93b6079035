#include "solve/kernel_spectra.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/constants.h"
#include "base/threads.h"
#include "ldf/texel_integral.h"
#include "solve/fft.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// The window falls like erfc around this radius, in standard deviations.
constexpr double window_radius = 4.75;
constexpr double window_end = 9.25;

// Place in the table of harmonics that a profile lacks.
constexpr std::size_t no_column = static_cast<std::size_t>(-1);

// Planes up to this size are all window.
constexpr std::size_t small_plane = 32;

// Gauss-Legendre rule of four points on [-1, 1].
constexpr std::array<double, 4> gauss_node = {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626,
                                              0.86113631159405258};
constexpr std::array<double, 4> gauss_weight = {0.34785484513745386, 0.65214515486254614, 0.65214515486254614,
                                                0.34785484513745386};

// Samples of projections: evenly near the window, then in proportion to the distance.
constexpr double even_step = 0.25;
constexpr double even_until = 32.0;
constexpr double growth = 1.012;
constexpr double sample_step = 0.5;  // of the transform: twice as fine as texels

double outside_window(double r, double deviation)
{
    return 0.5 * std::erfc((window_radius - r / deviation) / std::numbers::sqrt2);
}

// 1 up to `cut`, then smoothly to 0 over `taper`.
double before_cut(double r, double cut, double taper)
{
    if (r <= cut)
        return 1.0;
    if (r >= cut + taper)
        return 0.0;
    const double t = 1.0 - (r - cut) / taper;
    return t * t * t * (10.0 + t * (6.0 * t - 15.0));
}

double sinc(double x)
{
    return x == 0.0 ? 1.0 : std::sin(x) / x;
}

// 2 pi steps / size; whole turns are left out before they cost digits.
double turn_angle(std::size_t steps, std::size_t size)
{
    return 2.0 * pi * static_cast<double>(steps % size) / static_cast<double>(size);
}

// Weights of four neighbours at t in [0, 1] between the second and the third (Lagrange).
std::array<double, 4> cubic_weights(double t)
{
    const double a = t + 1.0;
    const double b = t - 1.0;
    const double c = t - 2.0;
    return {-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0};
}

}  // namespace

double reach(const RadialProfile& profile, double mean_free_path, double fraction)
{
    const double allowed = fraction * profile.cumulative(profile.support())[0];
    for (std::size_t k = 0; k < radius_bin_count; ++k)
        if (profile.remaining(radius_bin_edge(k))[0] <= allowed)
            return radius_bin_edge(k) * mean_free_path;
    return profile.support() * mean_free_path;
}

KernelSpectra::KernelSpectra(std::size_t width, std::size_t height, double pitch_x, double pitch_y,
                             std::vector<ScaledProfile> profiles, double window_deviation, std::size_t budget,
                             std::size_t terms)
    : m_plane{width, height, pitch_x, pitch_y},
      m_profiles(std::move(profiles)),
      m_texel(std::max(pitch_x, pitch_y)),
      m_deviation(window_deviation)
{
    for (const ScaledProfile& each : m_profiles)
        m_harmonics = std::max(m_harmonics, each.profile.harmonics());
    choose_window();
    choose_tiles(budget, terms);
    if (m_far)
        tabulate_hankel();
    integrate_near();
}

void KernelSpectra::choose_window()
{
    const auto [width, height] = std::pair(m_plane.width, m_plane.height);
    for (const ScaledProfile& each : m_profiles)
        m_cut = std::max(m_cut, each.reach / m_texel);
    const double px = m_plane.pitch_x / m_texel;
    const double py = m_plane.pitch_y / m_texel;
    const double diagonal = std::hypot(static_cast<double>(width) * px, static_cast<double>(height) * py);
    const double window = window_end * m_deviation;
    m_far = m_cut > window && std::max(width, height) > small_plane;
    if (m_far && m_cut > diagonal) {
        // No two texels are farther apart; an abrupt end would ring.
        m_cut = diagonal;
        m_taper = std::max(window, diagonal / 8.0);
    }
    const double near_end = m_far ? window : m_cut;
    const auto texels = [](double end, double pitch, std::size_t size) {
        return static_cast<std::size_t>(std::min(std::ceil(end / pitch + 0.5), static_cast<double>(size - 1)));
    };
    m_near_x = texels(near_end, px, width);
    m_near_y = texels(near_end, py, height);
    const auto halo = [&](double pitch, std::size_t near) {
        const double end = m_far ? std::ceil((m_cut + m_taper) / pitch) + 1.0 : 0.0;
        return std::max(near, static_cast<std::size_t>(end));
    };
    m_plane.halo_x = halo(px, m_near_x);
    m_plane.halo_y = halo(py, m_near_y);
}

void KernelSpectra::choose_tiles(std::size_t budget, std::size_t terms)
{
    const auto with_tiles = [&](std::size_t count) {
        PaddedPlane plane = m_plane;
        // What wraps around falls into the halo, and on the whole plane beyond its end.
        const auto pad = [&](std::size_t size, std::size_t halo, std::size_t& tile) {
            tile = (size + count - 1) / count;
            return fast_even_size(tile + (count > 1 ? 2 : 1) * halo);
        };
        plane.padded_width = pad(plane.width, plane.halo_x, plane.tile_width);
        plane.padded_height = pad(plane.height, plane.halo_y, plane.tile_height);
        return plane;
    };
    constexpr std::size_t most_tiles = 16;    // along a side
    constexpr double most_overlap = 1.25;  // that is worth having several light terms in memory at once
    const PaddedPlane whole = with_tiles(1);
    const double area = static_cast<double>(whole.padded_width * whole.padded_height);
    for (const std::size_t allowed : {budget / std::max<std::size_t>(terms, 1), budget}) {
        for (std::size_t count = 1; count <= most_tiles; ++count) {
            const PaddedPlane plane = with_tiles(count);
            const double overlap = static_cast<double>(count * count * plane.padded_width * plane.padded_height) / area;
            if (plane.rows() * plane.columns() * sizeof(Complex) <= allowed &&
                (allowed == budget || overlap <= most_overlap)) {
                m_plane = plane;
                return;
            }
        }
    }
    m_plane = whole;
}

// By the projection-slice theorem the two-dimensional transform of c_m(r) cos(m phi) along kx is the one-dimensional
// transform of its projection onto x, the integral over y of c_m(r) cos(m phi) with cos(m phi) = T_m(x / r).
void KernelSpectra::tabulate_hankel()
{
    const double end = m_cut + m_taper;
    std::vector<double> positions;
    for (int i = 0; i * even_step < even_until; ++i)
        positions.push_back(i * even_step);
    const std::size_t even_count = positions.size();
    for (int i = 0; positions.back() < std::max(end, 1.1 * even_until) * growth; ++i)
        positions.push_back(even_until * std::pow(growth, i));
    const std::size_t position_count = positions.size();

    const std::size_t samples = static_cast<std::size_t>(std::ceil(end / sample_step)) + 1;
    // Neighbours in the table are within 0.2 radians of each other's phase, where kernels are long 0.4: that table
    // would leave the cache, and such kernels hold little power at their ends.
    const std::size_t length = fast_even_size((samples <= 2048 ? 32 : 16) * samples);
    m_k_step = 2.0 * pi / (static_cast<double>(length) * sample_step);
    for (std::size_t p = 0; p < m_profiles.size(); ++p) {
        for (std::size_t m = 0; m < harmonic_count; ++m) {
            const RadialProfile& profile = m_profiles[p].profile;
            bool empty = true;
            for (std::size_t k = 0; k < radius_bin_count && m < profile.harmonics(); ++k)
                empty = empty && profile.remaining(radius_bin_edge(k))[m] == 0.0;
            m_column.push_back(empty ? no_column : m_table_columns++);
        }
    }
    const std::size_t columns = m_table_columns;
    const std::size_t last = static_cast<std::size_t>(0.95 * 2.0 * pi / m_k_step);
    m_table_rows = last + 4;
    m_table.assign(m_table_rows * columns, 0.0f);

    for (std::size_t p = 0; p < m_profiles.size(); ++p) {
        const RadialProfile& profile = m_profiles[p].profile;
        const double to_paths = m_texel / m_profiles[p].mean_free_path;
        // Panels of the integrals: steps of a texel in the window, then bins of the profile, halved.
        std::vector<double> breaks;
        for (int r = 0; r < std::min(end, 2.0 * window_end * m_deviation); ++r)
            breaks.push_back(r);
        for (std::size_t k = 0; k < radius_bin_count; ++k) {
            const double r = radius_bin_edge(k) / to_paths;
            const double next = k + 1 < radius_bin_count ? radius_bin_edge(k + 1) / to_paths : r;
            for (const double edge : {r, 0.5 * (r + next)})
                if (edge > breaks.back() && edge < end)
                    breaks.push_back(edge);
        }
        if (m_taper > 0.0) {
            for (int i = 0; i < 8; ++i)
                breaks.push_back(m_cut + m_taper * i / 8.0);
            std::sort(breaks.begin(), breaks.end());
        }
        breaks.push_back(end);

        std::vector<Harmonics> projections(position_count);
        parallel_for(position_count, [&](std::size_t n) {
            const double x = positions[n];
            Harmonics sum{};
            for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
                if (breaks[k + 1] <= x || breaks[k + 1] - breaks[k] <= 0.0)
                    continue;
                const double y0 = breaks[k] > x ? std::sqrt(breaks[k] * breaks[k] - x * x) : 0.0;
                const double y1 = std::sqrt(breaks[k + 1] * breaks[k + 1] - x * x);
                for (std::size_t q = 0; q < gauss_node.size(); ++q) {
                    const double y = 0.5 * (y0 + y1 + (y1 - y0) * gauss_node[q]);
                    const double r = std::hypot(x, y);
                    // Twice: for y and -y.
                    const double weight = gauss_weight[q] * (y1 - y0) * to_paths * to_paths *
                                          outside_window(r, m_deviation) * before_cut(r, m_cut, m_taper);
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
            }
            projections[n] = sum;
        });

        const double log_growth = std::log(growth);
        const auto projection = [&](double x, std::size_t m) {
            if (x < even_until)
                return projections[static_cast<std::size_t>(std::lround(x / even_step))][m];
            const double place = std::log(x / even_until) / log_growth;
            const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(place), 1, position_count - even_count - 3);
            const auto w = cubic_weights(place - static_cast<double>(i));
            double value = 0.0;
            for (std::size_t j = 0; j < 4; ++j)
                value += w[j] * projections[even_count + i - 1 + j][m];
            return value;
        };
        parallel_for(profile.harmonics(), [&](std::size_t m) {
            if (m_column[p * harmonic_count + m] == no_column)
                return;
            std::vector<float> line(length, 0.0f);
            for (std::size_t n = 0; n < samples; ++n)
                line[n] = static_cast<float>(2.0 * sample_step * projection(static_cast<double>(n) * sample_step, m));
            line[0] *= 0.5f;
            std::vector<Complex> half(length / 2 + 1);
            real_to_half(line.data(), half.data(), 1, length);
            float* column = m_table.data() + m_column[p * harmonic_count + m];
            for (std::size_t i = 0; i <= last; ++i)
                column[(i + 1) * columns] = m % 2 == 0 ? half[i].real() : -half[i].imag();
            column[0] = m % 2 == 0 ? column[2 * columns] : -column[2 * columns];
        });
    }
}

// The texels inside the window: exact integrals, less what the part outside brings to them.
void KernelSpectra::integrate_near()
{
    const std::size_t width = m_near_x + 1;
    const std::size_t texels = width * (m_near_y + 1);
    m_near.assign(m_profiles.size() * harmonic_count * 2 * texels, 0.0f);
    const double px = m_plane.pitch_x / m_texel;
    const double py = m_plane.pitch_y / m_texel;
    for (std::size_t p = 0; p < m_profiles.size(); ++p) {
        const RadialProfile& profile = m_profiles[p].profile;
        const double to_paths = m_texel / m_profiles[p].mean_free_path;
        const TexelIntegrals exact = integrate_texels(
            profile, {-0.5 * px * to_paths, -0.5 * py * to_paths, px * to_paths, py * to_paths, width, m_near_y + 1});
        parallel_for(texels, [&](std::size_t texel) {
            const std::size_t row = texel / width;
            const double x0 = (static_cast<double>(texel % width) - 0.5) * px;
            const double y0 = (static_cast<double>(row) - 0.5) * py;
            Harmonics cosine{};
            Harmonics sine{};
            for (std::size_t i = 0; m_far && i < gauss_node.size() * gauss_node.size(); ++i) {
                const double x = x0 + 0.5 * px * (1.0 + gauss_node[i % gauss_node.size()]);
                const double y = y0 + 0.5 * py * (1.0 + gauss_node[i / gauss_node.size()]);
                const double r = std::hypot(x, y);
                const Harmonics c = profile.density(r * to_paths);
                const double weight = 0.25 * px * py * gauss_weight[i % gauss_node.size()] *
                                      gauss_weight[i / gauss_node.size()] * to_paths * to_paths *
                                      outside_window(r, m_deviation) * before_cut(r, m_cut, m_taper);
                const double phi = std::atan2(y, x);
                for (std::size_t m = 0; m < profile.harmonics(); ++m) {
                    cosine[m] += weight * c[m] * std::cos(static_cast<double>(m) * phi);
                    sine[m] += weight * c[m] * std::sin(static_cast<double>(m) * phi);
                }
            }
            for (std::size_t m = 0; m < profile.harmonics(); ++m) {
                float* kernel = m_near.data() + (p * harmonic_count + m) * 2 * texels + texel;
                kernel[0] = static_cast<float>(exact.cosine[m * texels + texel] - cosine[m]);
                kernel[texels] = static_cast<float>(exact.sine[m * texels + texel] - sine[m]);
            }
        });
    }
    const std::size_t frequencies = m_plane.padded_height / 2 + 1;
    for (std::size_t f = 0; f < frequencies; ++f)
        m_sinc_y.push_back(
            static_cast<float>(sinc(pi * static_cast<double>(f) / static_cast<double>(m_plane.padded_height))));
    m_near_trig.resize(2 * (m_near_y + 1) * frequencies);
    for (std::size_t y = 0; y <= m_near_y; ++y) {
        float* cosine = m_near_trig.data() + y * frequencies;
        float* sine = cosine + (m_near_y + 1) * frequencies;
        const double twice = y == 0 ? 1.0 : 2.0;
        for (std::size_t f = 0; f < frequencies; ++f) {
            const double angle = turn_angle(y * f, m_plane.padded_height);
            cosine[f] = static_cast<float>(twice * std::cos(angle));
            sine[f] = static_cast<float>(twice * std::sin(angle));
        }
    }
}

void KernelSpectra::start(std::size_t frequency, Column& column) const
{
    column.near_cosine.resize(m_near_x + 1);
    column.near_sine.resize(m_near_x + 1);
    for (std::size_t x = 0; x <= m_near_x; ++x) {
        const double twice = x == 0 ? 1.0 : 2.0;
        const double angle = turn_angle(x * frequency, m_plane.padded_width);
        column.near_cosine[x] = twice * std::cos(angle);
        column.near_sine[x] = twice * std::sin(angle);
    }
    if (!m_far)
        return;
    const std::size_t frequencies = m_plane.padded_height / 2 + 1;
    const std::size_t functions = m_table_columns;
    column.trig.resize(2 * m_harmonics * frequencies);
    column.hankel.resize(functions * frequencies);
    // Per metre, then per texel of unit length.
    const double x_turn = pi * static_cast<double>(frequency) / static_cast<double>(m_plane.padded_width);
    const double kx = 2.0 * x_turn * m_texel / m_plane.pitch_x;
    const double sinc_x = sinc(x_turn);
    const bool x_nyquist = 2 * frequency == m_plane.padded_width;

    column.values.resize(functions);
    float* values = column.values.data();
    column.k.resize(frequencies);
    for (auto* part : {&column.cos_psi, &column.sin_psi, &column.cosine, &column.sine})
        part->resize(frequencies);
    for (std::size_t f = 0; f < frequencies; ++f) {
        const double y_turn = pi * static_cast<double>(f) / static_cast<double>(m_plane.padded_height);
        const double ky = 2.0 * y_turn * m_texel / m_plane.pitch_y;
        const double k = std::sqrt(kx * kx + ky * ky);
        column.k[f] = k;
        column.cos_psi[f] = static_cast<float>(k > 0.0 ? kx / k : 1.0);
        column.sin_psi[f] = static_cast<float>(k > 0.0 ? ky / k : 0.0);
        column.cosine[f] = static_cast<float>(sinc_x) * m_sinc_y[f];
        column.sine[f] = 0.0f;
    }
    for (std::size_t m = 0; m < m_harmonics; ++m) {
        float* trig = column.trig.data() + 2 * m * frequencies;
        std::copy(column.cosine.begin(), column.cosine.end(), trig);
        std::copy(column.sine.begin(), column.sine.end(), trig + frequencies);
        // At the Nyquist frequency a function that is odd along that axis has no spectrum.
        if (x_nyquist)
            std::fill_n(m % 2 == 1 ? trig : trig + frequencies, frequencies, 0.0f);
        trig[2 * frequencies - 1] = 0.0f;
        turn(column.cosine.data(), column.sine.data(), column.cos_psi.data(), column.sin_psi.data(), frequencies);
    }
    for (std::size_t f = 0; f < frequencies; ++f) {
        const double place = column.k[f] / m_k_step;
        const std::size_t row = std::min(static_cast<std::size_t>(place), m_table_rows - 4);
        const auto w = cubic_weights(std::min(place - static_cast<double>(row), 1.0));
        const std::array<float, 4> weights = {static_cast<float>(w[0]), static_cast<float>(w[1]),
                                              static_cast<float>(w[2]), static_cast<float>(w[3])};
        interpolate(values, m_table.data() + row * functions, functions, weights.data(), functions);
        for (std::size_t i = 0; i < functions; ++i)
            column.hankel[i * frequencies + f] = values[i];
    }
}

void KernelSpectra::spectrum(const Column& column, const KernelTerm* terms, std::size_t count, float* values) const
{
    const std::size_t frequencies = m_plane.padded_height / 2 + 1;
    const std::size_t width = m_near_x + 1;
    const std::size_t texels = width * (m_near_y + 1);
    const bool sine = terms[0].phase == Phase::sine;
    const bool odd_m = terms[0].m % 2 == 1;
    // A_m is even along x for even m, odd for odd m, and even along y; B_m the other way round. Sums over pairs of
    // odd functions bring factors -i: squared for B_m of even m, once for odd m, where it is left out.
    const std::vector<double>& along_x = odd_m != sine ? column.near_sine : column.near_cosine;
    const double sign = sine && !odd_m ? -1.0 : 1.0;
    for (std::size_t y = 0; y <= m_near_y; ++y) {
        double sum = 0.0;
        for (std::size_t t = 0; t < count; ++t) {
            const std::size_t function = terms[t].profile * harmonic_count + terms[t].m;
            const float* near = m_near.data() + (function * 2 + (sine ? 1 : 0)) * texels + y * width;
            double row = 0.0;
            for (std::size_t x = 0; x <= m_near_x; ++x)
                row += along_x[x] * static_cast<double>(near[x]);
            sum += terms[t].weight * row;
        }
        const float* trig = m_near_trig.data() + ((sine ? m_near_y + 1 : 0) + y) * frequencies;
        const auto factor = static_cast<float>(sign * sum);
        if (y == 0)
            scale(values, trig, factor, frequencies);
        else
            add_scaled(values, trig, factor, frequencies);
    }
    for (std::size_t t = 0; m_far && t < count; ++t) {
        const std::size_t function = m_column[terms[t].profile * harmonic_count + terms[t].m];
        if (function == no_column)
            continue;
        const float* trig = column.trig.data() + (2 * terms[t].m + (sine ? 1 : 0)) * frequencies;
        const float* hankel = column.hankel.data() + function * frequencies;
        add_scaled_product(values, trig, hankel, static_cast<float>(terms[t].weight), frequencies);
    }
    for (std::size_t f = frequencies; f < m_plane.padded_height; ++f)
        values[f] = sine ? -values[m_plane.padded_height - f] : values[m_plane.padded_height - f];
}

}  // namespace beamspread
