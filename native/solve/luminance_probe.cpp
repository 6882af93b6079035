#include "solve/luminance_probe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "base/threads.h"
#include "ldf/texel_integral.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// Squares are looked at as a whole if more than so many of their size lie between them and the texel.
constexpr std::size_t squares_between = 2;

constexpr std::size_t angle_steps = 256;
constexpr double radii_per_octave = 16.0;

// Texels from the middle to the border of the 17 x 17; light from farther than `nearby_sources` is taken to be the same
// on all of them.
constexpr std::size_t nearby_texels = 8;
constexpr std::size_t nearby_sources = 16;
constexpr std::size_t nearby_reach = nearby_texels + nearby_sources;

// Functions of m = 0 that the mean over these is made of: others are as small as its error.
constexpr std::size_t nearby_ranks = 4;

// What beams bring to where they travel away from, at least, relative to the mean of all azimuths.
constexpr double least_asymmetry = 0.1;

std::size_t distance(std::size_t a, std::size_t b)
{
    return a > b ? a - b : b - a;
}

// A quadrant of texels around a beam.
TexelIntegrals integrate_quadrant(const ScaledProfile& scaled, double pitch_x, double pitch_y, std::size_t size)
{
    const double px = pitch_x / scaled.mean_free_path;
    const double py = pitch_y / scaled.mean_free_path;
    return integrate_texels(scaled.profile, {-0.5 * px, -0.5 * py, px, py, size, size});
}

}  // namespace

struct LuminanceProbe::Place {
    std::size_t y;
    std::size_t x;
    std::vector<float> near;   // [medium][rank][m]: by light from up to `nearby_sources` away
    std::vector<float> far;    // and from beyond
    std::vector<float> light;  // of a beam by rank and harmonic
    std::vector<float> cosine;
    std::vector<float> sine;
    std::vector<double> nearby;
};

LuminanceProbe::LuminanceProbe(const std::vector<LightPyramid>& lights, const LowRankBasis& basis, double pitch_x,
                               double pitch_y)
    : m_lights(lights),
      m_height(lights.front().height()),
      m_width(lights.front().width()),
      m_pitch_x(pitch_x),
      m_pitch_y(pitch_y),
      m_media(basis.profiles.size()),
      m_ranks(basis.profiles.front().size()),
      m_first(basis.first),
      m_per_step(basis.last > basis.first ? static_cast<double>(angle_steps) / (basis.last - basis.first) : 0.0),
      m_least_radius(std::min(pitch_x, pitch_y))
{
    std::vector<std::size_t> harmonics(m_ranks, 1);  // m = 0 has a place in every row
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        harmonics[function.rank] = std::max(harmonics[function.rank], function.m + 1);
    m_starts.push_back(0);
    for (const std::size_t count : harmonics) {
        m_starts.push_back(m_starts.back() + count);
        m_harmonics = std::max(m_harmonics, count);
    }
    for (const LowRankBasis::AngleFunction& function : basis.functions)
        m_place.push_back(m_starts[function.rank] + function.m);
    tabulate_angles(basis);
    tabulate_radii(basis);
    integrate_near(basis);
    integrate_nearby(basis);
}

void LuminanceProbe::tabulate_angles(const LowRankBasis& basis)
{
    m_by_angle.resize((angle_steps + 1) * functions());
    for (std::size_t step = 0; step <= angle_steps; ++step)
        for (std::size_t f = 0; f < m_place.size(); ++f) {
            const std::vector<float>& values = basis.functions[f].values;
            m_by_angle[step * functions() + m_place[f]] = values[step * (values.size() - 1) / angle_steps];
        }
}

void LuminanceProbe::tabulate_radii(const LowRankBasis& basis)
{
    double longest = 0.0;
    for (const std::vector<ScaledProfile>& profiles : basis.profiles)
        longest = std::max(longest, profiles.front().reach);
    longest = std::min(longest,
                       std::hypot(static_cast<double>(m_width) * m_pitch_x, static_cast<double>(m_height) * m_pitch_y));
    const double octaves = std::log2(std::max(longest / m_least_radius, 1.0));
    m_radii = static_cast<std::size_t>(std::ceil(octaves * radii_per_octave)) + 1;
    m_by_radius.resize(m_radii * m_media * functions());
    parallel_for(m_radii, [&](std::size_t step) {
        const double r = m_least_radius * std::exp2(static_cast<double>(step) / radii_per_octave);
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

void LuminanceProbe::integrate_near(const LowRankBasis& basis)
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

void LuminanceProbe::integrate_nearby(const LowRankBasis& basis)
{
    constexpr std::size_t size = 2 * nearby_reach + 2;  // a row and a column of zeros come first
    const std::size_t ranks = std::min(m_ranks, nearby_ranks);
    m_nearby.resize(m_media * ranks * size * size);
    parallel_for(m_media * ranks, [&](std::size_t item) {
        const ScaledProfile& scaled = basis.profiles[item / ranks][item % ranks];
        ScaledProfile power{RadialProfile(), scaled.mean_free_path};
        Harmonics only{};
        only[0] = 1.0;
        power.profile.add(scaled.profile, only);
        const TexelIntegrals integrals = integrate_quadrant(power, m_pitch_x, m_pitch_y, nearby_reach + 1);
        double* sums = m_nearby.data() + item * size * size;
        for (std::size_t y = 1; y < size; ++y)
            for (std::size_t x = 1; x < size; ++x)
                sums[y * size + x] =
                    integrals
                        .cosine[distance(y, nearby_reach + 1) * (nearby_reach + 1) + distance(x, nearby_reach + 1)] +
                    sums[(y - 1) * size + x] + sums[y * size + x - 1] - sums[(y - 1) * size + x - 1];
    });
}

LuminanceProbe::Reading LuminanceProbe::read(std::size_t y, std::size_t x) const
{
    const std::size_t size = m_media * functions();
    Place place{y,
                x,
                std::vector<float>(size),
                std::vector<float>(size),
                std::vector<float>(functions()),
                std::vector<float>(m_harmonics),
                std::vector<float>(m_harmonics),
                std::vector<double>(m_media)};
    for (const LightPyramid& light : m_lights) {
        add_square(place, light, light.top(), 0, 0);
        add_nearby(place, light);
    }
    Reading reading{{}, std::move(place.nearby)};
    for (std::size_t k = 0; k < m_media; ++k) {
        const float* near = place.near.data() + k * functions();
        const float* far = place.far.data() + k * functions();
        double beyond = 0.0;
        double within = 0.0;
        double beyond_evenly = 0.0;  // by m = 0
        double within_evenly = 0.0;
        for (const std::size_t f : m_place) {
            reading.parts.push_back(near[f] + far[f]);
            beyond += static_cast<double>(far[f]);
            within += static_cast<double>(near[f]);
        }
        for (std::size_t rank = 0; rank < m_ranks; ++rank) {
            beyond_evenly += static_cast<double>(far[m_starts[rank]]);
            within_evenly += static_cast<double>(near[m_starts[rank]]);
        }
        // Where light travels away from, `nearby` holds too much: it knows m = 0 only. A single beam's sum of harmonics
        // may be far too small.
        if (within < within_evenly)
            reading.nearby[k] *= std::max(within / within_evenly, least_asymmetry);
        reading.nearby[k] += std::max(beyond, least_asymmetry * beyond_evenly);
    }
    return reading;
}

void LuminanceProbe::add_square(Place& place, const LightPyramid& light, std::size_t level, std::size_t y,
                                std::size_t x) const
{
    const LightPyramid::Beam beam = light.beam(level, y, x);
    if (beam.irradiance == 0.0f)
        return;
    if (std::max(distance(place.y >> level, y), distance(place.x >> level, x)) > squares_between) {
        const double middle = 0.5 * static_cast<double>((std::size_t{1} << level) - 1);
        add_far(place, beam, level, static_cast<double>(place.x) - static_cast<double>(x << level) - middle,
                static_cast<double>(place.y) - static_cast<double>(y << level) - middle);
    } else if (level == 0) {
        add_near(place, beam, static_cast<std::ptrdiff_t>(place.x) - static_cast<std::ptrdiff_t>(x),
                 static_cast<std::ptrdiff_t>(place.y) - static_cast<std::ptrdiff_t>(y));
    } else {
        for (std::size_t i = 0; i < 4; ++i)
            add_square(place, light, level - 1, 2 * y + i / 2, 2 * x + i % 2);
    }
}

const float* LuminanceProbe::at_angle(const Vec3f& direction) const
{
    const double across = std::sqrt(static_cast<double>(direction.x * direction.x + direction.y * direction.y));
    const double half_tangent = across / (1.0 - static_cast<double>(direction.z));
    const double place = std::clamp((half_tangent - m_first) * m_per_step, 0.0, static_cast<double>(angle_steps));
    return m_by_angle.data() + static_cast<std::size_t>(std::lround(place)) * functions();
}

void LuminanceProbe::add_far(Place& place, const LightPyramid::Beam& beam, std::size_t level, double dx,
                             double dy) const
{
    const double x = dx * m_pitch_x;
    const double y = dy * m_pitch_y;
    const double square = x * x + y * y;
    const double octave = 0.5 * std::log2(square / (m_least_radius * m_least_radius));
    const auto step = static_cast<std::size_t>(std::lround(std::max(octave, 0.0) * radii_per_octave));
    if (step >= m_radii)
        return;
    const float* by_radius = m_by_radius.data() + step * m_media * functions();

    // cos(m (phi - beta)) by Chebyshev's recurrence. Over the angle 2 w of the square its mean is by about
    // sin(m w) / (m w) smaller, of which this is the envelope: what is left where light ends.
    const auto u = static_cast<double>(beam.direction.x);
    const auto v = static_cast<double>(beam.direction.y);
    const double lengths = std::sqrt(square * (u * u + v * v));
    const double cosine = lengths > 0.0 ? (x * u + y * v) / lengths : 1.0;
    double before = cosine;
    double now = 1.0;
    const float half_width =
        0.5f * static_cast<float>(std::size_t{1} << level) / static_cast<float>(std::hypot(dx, dy));
    for (std::size_t m = 0; m < m_harmonics; ++m) {
        const float turned = half_width * static_cast<float>(m);
        place.cosine[m] = static_cast<float>(now) / std::sqrt(1.0f + turned * turned);
        const double next = 2.0 * cosine * now - before;
        before = now;
        now = next;
    }
    scale_columns(place.light.data(), at_angle(beam.direction), place.cosine.data(), beam.irradiance, m_starts.data(),
                  m_ranks);
    const bool nearby = std::max(std::abs(dx), std::abs(dy)) < static_cast<double>(nearby_sources) + 0.5;
    float* sums = nearby ? place.near.data() : place.far.data();
    for (std::size_t k = 0; k < m_media; ++k)
        add_scaled_product(sums + k * functions(), place.light.data(), by_radius + k * functions(), 1.0f, functions());
}

void LuminanceProbe::add_near(Place& place, const LightPyramid::Beam& beam, std::ptrdiff_t dx, std::ptrdiff_t dy) const
{
    // cos(m beta), sin(m beta); phi -> -phi for dy < 0, and phi -> pi - phi for dx < 0.
    const std::complex<double> travel(static_cast<double>(beam.direction.x), static_cast<double>(beam.direction.y));
    std::complex<double> once = std::abs(travel) > 0.0 ? travel / std::abs(travel) : 1.0;
    if (dx < 0)
        once = -std::conj(once);
    if (dy < 0)
        once = std::conj(once);
    std::complex<double> turned = 1.0;
    for (std::size_t m = 0; m < m_harmonics; ++m, turned *= once) {
        place.cosine[m] = static_cast<float>(turned.real());
        place.sine[m] = static_cast<float>(turned.imag());
    }
    const std::size_t texel =
        static_cast<std::size_t>(std::abs(dy)) * (squares_between + 1) + static_cast<std::size_t>(std::abs(dx));
    const float* kernels = m_near.data() + 2 * texel * m_media * functions();
    const float* by_angle = at_angle(beam.direction);
    for (const std::vector<float>* phase : {&place.cosine, &place.sine}) {
        scale_columns(place.light.data(), by_angle, phase->data(), beam.irradiance, m_starts.data(), m_ranks);
        for (std::size_t k = 0; k < m_media; ++k, kernels += functions())
            add_scaled_product(place.near.data() + k * functions(), place.light.data(), kernels, 1.0f, functions());
    }
}

// The mean over those of the 17 x 17 texels that lie on the plane, of light that enters up to 16 texels away.
void LuminanceProbe::add_nearby(Place& place, const LightPyramid& light) const
{
    constexpr std::size_t size = 2 * nearby_reach + 2;
    struct Span {
        std::size_t first;
        std::size_t end;
    };
    const auto around = [](std::size_t at, std::size_t reach, std::size_t texels) {
        return Span{at - std::min(at, reach), std::min(texels, at + reach + 1)};
    };
    const Span window_y = around(place.y, nearby_texels, m_height);
    const Span window_x = around(place.x, nearby_texels, m_width);
    const Span sources_y = around(place.y, nearby_sources, m_height);
    const Span sources_x = around(place.x, nearby_sources, m_width);
    const double texels = static_cast<double>((window_y.end - window_y.first) * (window_x.end - window_x.first));
    const std::size_t ranks = std::min(m_ranks, nearby_ranks);
    for (std::size_t y = sources_y.first; y < sources_y.end; ++y) {
        for (std::size_t x = sources_x.first; x < sources_x.end; ++x) {
            const LightPyramid::Beam beam = light.beam(0, y, x);
            if (beam.irradiance == 0.0f)
                continue;
            const float* by_angle = at_angle(beam.direction);
            // Where the window lies in tables around the source.
            const std::size_t y0 = window_y.first + nearby_reach - y;
            const std::size_t y1 = window_y.end + nearby_reach - y;
            const std::size_t x0 = window_x.first + nearby_reach - x;
            const std::size_t x1 = window_x.end + nearby_reach - x;
            const double* sums = m_nearby.data();
            for (std::size_t k = 0; k < m_media; ++k)
                for (std::size_t rank = 0; rank < ranks; ++rank, sums += size * size)
                    place.nearby[k] +=
                        static_cast<double>(beam.irradiance * by_angle[m_starts[rank]]) / texels *
                        (sums[y1 * size + x1] - sums[y0 * size + x1] - sums[y1 * size + x0] + sums[y0 * size + x0]);
        }
    }
}

}  // namespace beamspread
