#include "solve/luminance_probe.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/threads.h"
#include "ldf/texel_integral.h"
#include "solve/loops.h"

namespace beamspread {

namespace {

// Squares are looked at as a whole if more than so many of their size lie between them and the texel.
constexpr std::size_t squares_between = 2;

constexpr std::size_t angle_steps = 256;
constexpr float radii_per_octave = 16.0f;

// Of the distances of squares looked at as a whole, in units of their size.
constexpr std::size_t distances_per_size = 8;
constexpr std::size_t distances = 4 * distances_per_size * (squares_between + 1);

// Texels from the middle to the border of the 17 x 17; light from farther than `nearby_sources` is taken to be the same
// on all of them.
constexpr std::size_t nearby_texels = 8;
constexpr std::size_t nearby_sources = 16;

// The mean over the 17 x 17 takes this light in squares.
constexpr std::size_t nearby_level = 2;
constexpr std::size_t nearby_side = std::size_t{1} << nearby_level;
constexpr std::size_t nearby_reach = nearby_texels + nearby_sources + 1;  // from a square's first texel

// Functions of m = 0 that the mean over these is made of: others are as small as its error.
constexpr std::size_t nearby_ranks = 4;

// What beams bring to where they travel away from, at least, relative to the mean of all azimuths: about what the sum of
// harmonics is off by.
constexpr double least_asymmetry = 0.03;

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
    std::vector<float> light;  // of a square by rank and harmonic
    std::vector<float> cosine;
    std::vector<float> sine;
    std::vector<float> mean;  // of cosines over a square
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
      m_first(static_cast<float>(basis.first)),
      m_per_step(basis.last > basis.first ? static_cast<float>(angle_steps / (basis.last - basis.first)) : 0.0f),
      m_least_radius(std::min(pitch_x, pitch_y))
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
        m_place.push_back(m_starts[function.rank] + function.m);
    tabulate_angles(basis);
    tabulate_radii(basis);
    tabulate_widths();
    integrate_near(basis);
    integrate_nearby(basis);
}

void LuminanceProbe::tabulate_angles(const LowRankBasis& basis)
{
    m_by_angle.resize(angle_steps * functions());
    for (std::size_t step = 0; step < angle_steps; ++step)
        for (std::size_t f = 0; f < m_place.size(); ++f) {
            const std::vector<TableStep>& values = basis.functions[f].values;
            m_by_angle[step * functions() + m_place[f]] =
                values[(2 * step + 1) * (values.size() - 1) / (2 * angle_steps)].value;
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
    m_radii = static_cast<std::size_t>(std::ceil(octaves * static_cast<double>(radii_per_octave))) + 1;
    m_by_radius.resize(m_radii * m_media * functions());
    parallel_for(m_radii, [&](std::size_t step) {
        const double r =
            m_least_radius * std::exp2((static_cast<double>(step) + 0.5) / static_cast<double>(radii_per_octave));
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

// Over the angle 2 w that a square takes up, the mean of a harmonic is by about sin(m w) / (m w) smaller, of which this
// is the envelope: what is left where light ends.
void LuminanceProbe::tabulate_widths()
{
    m_by_width.resize(distances * m_harmonics);
    for (std::size_t step = 0; step < distances; ++step) {
        const float half_width = 0.5f * static_cast<float>(distances_per_size) / (static_cast<float>(step) + 0.5f);
        for (std::size_t m = 0; m < m_harmonics; ++m) {
            const float turned = half_width * static_cast<float>(m);
            m_by_width[step * m_harmonics + m] = 1.0f / std::sqrt(1.0f + turned * turned);
        }
    }
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
                std::vector<float>(m_harmonics),
                std::vector<double>(m_media)};
    add_square(place, m_lights.front().top(), 0, 0);
    add_nearby(place);
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

void LuminanceProbe::add_square(Place& place, std::size_t level, std::size_t y, std::size_t x) const
{
    if (std::max(distance(place.y >> level, y), distance(place.x >> level, x)) > squares_between)
        add_far(place, level, y, x);
    else if (level == 0)
        add_near(place, y, x);
    else if (std::any_of(m_lights.begin(), m_lights.end(),
                         [&](const LightPyramid& light) { return light.beam(level, y, x).irradiance > 0.0f; }))
        for (std::size_t i = 0; i < 4; ++i)
            add_square(place, level - 1, 2 * y + i / 2, 2 * x + i % 2);
}

const float* LuminanceProbe::at_angle(const Vec3f& direction) const
{
    const float across = std::sqrt(direction.x * direction.x + direction.y * direction.y);
    const float half_tangent = across / (1.0f - direction.z);
    const auto step = static_cast<std::size_t>(std::max((half_tangent - m_first) * m_per_step, 0.0f));
    return m_by_angle.data() + std::min(step, angle_steps - 1) * functions();
}

void LuminanceProbe::add_far(Place& place, std::size_t level, std::size_t y, std::size_t x) const
{
    // From the middle of the square to the texel, in texels.
    const auto size = static_cast<float>(std::size_t{1} << level);
    const auto away = [&](std::size_t at, std::size_t square) {
        return static_cast<float>(at) - (static_cast<float>(square) + 0.5f) * size + 0.5f;
    };
    const float dx = away(place.x, x);
    const float dy = away(place.y, y);
    const float offset_x = dx * static_cast<float>(m_pitch_x / m_least_radius);
    const float offset_y = dy * static_cast<float>(m_pitch_y / m_least_radius);
    const float square = offset_x * offset_x + offset_y * offset_y;
    const float octave = 0.5f * std::log2(square);
    const auto radius = static_cast<std::size_t>(std::max(octave, 0.0f) * radii_per_octave);
    if (radius >= m_radii)
        return;
    const auto width =
        static_cast<std::size_t>(std::sqrt(dx * dx + dy * dy) * static_cast<float>(distances_per_size) / size);
    const float* by_width = m_by_width.data() + std::min(width, distances - 1) * m_harmonics;

    std::fill(place.light.begin(), place.light.end(), 0.0f);
    bool lit = false;
    for (const LightPyramid& light : m_lights) {
        const SquareBeam beam = light.beam(level, y, x);
        if (beam.irradiance == 0.0f)
            continue;
        lit = true;
        const float u = beam.direction.x;
        const float v = beam.direction.y;
        const float lengths = std::sqrt(square * (u * u + v * v));
        const float per_length = lengths > 0.0f ? 1.0f / lengths : 0.0f;
        const float cosine = lengths > 0.0f ? (offset_x * u + offset_y * v) * per_length : 1.0f;
        const float sine = (offset_y * u - offset_x * v) * per_length;
        multiple_angles(place.cosine.data(), place.sine.data(), cosine, sine, m_harmonics);
        multiply(place.mean.data(), place.cosine.data(), by_width, beam.irradiance, m_harmonics);
        add_harmonics(place.light.data(), at_angle(beam.direction), place.mean.data(), m_columns.data(),
                      m_columns.size());
    }
    if (!lit)
        return;
    const bool nearby = std::max(std::abs(dx), std::abs(dy)) < static_cast<float>(nearby_sources) + 0.5f;
    float* sums = nearby ? place.near.data() : place.far.data();
    const float* by_radius = m_by_radius.data() + radius * m_media * functions();
    for (std::size_t k = 0; k < m_media; ++k)
        add_scaled_product(sums + k * functions(), place.light.data(), by_radius + k * functions(), 1.0f, functions());
}

void LuminanceProbe::add_near(Place& place, std::size_t y, std::size_t x) const
{
    const std::size_t texel = distance(place.y, y) * (squares_between + 1) + distance(place.x, x);
    for (const LightPyramid& light : m_lights) {
        const SquareBeam beam = light.beam(0, y, x);
        if (beam.irradiance == 0.0f)
            continue;
        // cos(m beta), sin(m beta); phi -> pi - phi where the texel lies to the left of the light, and phi -> -phi
        // where below.
        const float across = std::hypot(beam.direction.x, beam.direction.y);
        const float cosine = across > 0.0f ? beam.direction.x / across : 1.0f;
        const float sine = across > 0.0f ? beam.direction.y / across : 0.0f;
        multiple_angles(place.cosine.data(), place.sine.data(), place.x < x ? -cosine : cosine,
                        place.y < y ? -sine : sine, m_harmonics);
        const float* kernels = m_near.data() + 2 * texel * m_media * functions();
        const float* by_angle = at_angle(beam.direction);
        for (const std::vector<float>* phase : {&place.cosine, &place.sine}) {
            std::fill(place.light.begin(), place.light.end(), 0.0f);
            add_harmonics(place.light.data(), by_angle, phase->data(), m_columns.data(), m_columns.size());
            for (std::size_t k = 0; k < m_media; ++k, kernels += functions())
                add_scaled_product(place.near.data() + k * functions(), place.light.data(), kernels, beam.irradiance,
                                   functions());
        }
    }
}

// The mean over those of the 17 x 17 texels that lie on the plane, of light that enters up to 16 texels away.
void LuminanceProbe::add_nearby(Place& place) const
{
    constexpr std::size_t size = 2 * nearby_reach + 2;
    struct Span {
        std::size_t first;
        std::size_t end;
    };
    const auto window = [](std::size_t at, std::size_t texels) {
        return Span{at - std::min(at, nearby_texels), std::min(texels, at + nearby_texels + 1)};
    };
    // Squares whose middle lies that near.
    const auto sources = [](std::size_t at) {
        return Span{(at + 2 - std::min(at + 2, nearby_sources)) / nearby_side, (at + nearby_sources + 2) / nearby_side};
    };
    const Span window_y = window(place.y, m_height);
    const Span window_x = window(place.x, m_width);
    const double texels = static_cast<double>((window_y.end - window_y.first) * (window_x.end - window_x.first));
    const std::size_t ranks = std::min(m_ranks, nearby_ranks);
    for (std::size_t y = sources(place.y).first; y < sources(place.y).end; ++y)
        for (std::size_t x = sources(place.x).first; x < sources(place.x).end; ++x)
            for (const LightPyramid& light : m_lights) {
                const SquareBeam beam = light.beam(nearby_level, y, x);
                if (beam.irradiance == 0.0f)
                    continue;
                const float* by_angle = at_angle(beam.direction);
                // Where the window lies in tables around the source.
                const std::size_t y0 = window_y.first + nearby_reach - nearby_side * y;
                const std::size_t y1 = window_y.end + nearby_reach - nearby_side * y;
                const std::size_t x0 = window_x.first + nearby_reach - nearby_side * x;
                const std::size_t x1 = window_x.end + nearby_reach - nearby_side * x;
                const double* sums = m_nearby.data();
                for (std::size_t k = 0; k < m_media; ++k)
                    for (std::size_t rank = 0; rank < ranks; ++rank, sums += size * size)
                        place.nearby[k] +=
                            static_cast<double>(beam.irradiance * by_angle[m_starts[rank]]) / texels *
                            (sums[y1 * size + x1] - sums[y0 * size + x1] - sums[y1 * size + x0] + sums[y0 * size + x0]);
            }
}

}  // namespace beamspread
