#include "solve/luminance_probe.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "solve/loops.h"

namespace beamspread {

namespace {

// What beams bring to where they travel away from, at least, relative to the mean of all azimuths: what most sums of
// harmonics are off by.
constexpr double least_asymmetry = 0.01;

// By how much the azimuth of beams turns, about; zero where one of them is dark or they have little to do with each other.
float turn_between(const SquareBeam& from, const SquareBeam& to)
{
    const float cosine = from.direction.x * to.direction.x + from.direction.y * to.direction.y;
    const float sine = from.direction.x * to.direction.y - from.direction.y * to.direction.x;
    return cosine > 0.0f ? sine / cosine : 0.0f;
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
    std::vector<std::array<SquareBeam, 4>> quarters;  // [light]: of the square that is looked at
};

LuminanceProbe::LuminanceProbe(const std::vector<LightPyramid>& lights, const LowRankBasis& basis, double pitch_x,
                               double pitch_y)
    : m_lights(lights),
      m_height(lights.front().height()),
      m_width(lights.front().width()),
      m_pitch_x(pitch_x),
      m_pitch_y(pitch_y),
      m_tables(basis, pitch_x, pitch_y, m_height, m_width)
{
}

LuminanceProbe::Reading LuminanceProbe::read(std::size_t y, std::size_t x) const
{
    const std::size_t functions = m_tables.functions();
    const std::size_t media = m_tables.media();
    const std::size_t size = media * functions;
    Place place{y,
                x,
                std::vector<float>(size),
                std::vector<float>(size),
                std::vector<float>(functions),
                std::vector<float>(m_tables.harmonics()),
                std::vector<float>(m_tables.harmonics()),
                std::vector<float>(m_tables.harmonics()),
                std::vector<double>(media),
                std::vector<std::array<SquareBeam, 4>>(m_lights.size())};
    add_square(place, m_lights.front().top(), 0, 0);
    add_nearby(place);
    Reading reading{{}, std::move(place.nearby)};
    for (std::size_t k = 0; k < media; ++k) {
        const float* near = place.near.data() + k * functions;
        const float* far = place.far.data() + k * functions;
        double beyond = 0.0;
        double within = 0.0;
        double beyond_evenly = 0.0;  // by m = 0
        double within_evenly = 0.0;
        for (const std::size_t f : m_tables.places()) {
            reading.parts.push_back(near[f] + far[f]);
            beyond += static_cast<double>(far[f]);
            within += static_cast<double>(near[f]);
        }
        for (std::size_t rank = 0; rank < m_tables.ranks(); ++rank) {
            beyond_evenly += static_cast<double>(far[m_tables.start(rank)]);
            within_evenly += static_cast<double>(near[m_tables.start(rank)]);
        }
        // Where light travels away from, `nearby` holds too much: it knows m = 0 only. A single beam's sum of harmonics
        // may be far too small.
        if (within < within_evenly)
            reading.nearby[k] *= std::max(within / within_evenly, least_asymmetry);
        reading.nearby[k] += std::max(beyond, least_asymmetry * beyond_evenly);
    }
    return reading;
}

// Of a square too near to be looked at as a whole.
void LuminanceProbe::add_square(Place& place, std::size_t level, std::size_t y, std::size_t x) const
{
    if (level == 0)
        return add_near(place, y, x);
    std::array<bool, 4> lit{};
    for (std::size_t l = 0; l < m_lights.size(); ++l)
        for (std::size_t i = 0; i < 4; ++i) {
            place.quarters[l][i] = m_lights[l].beam(level - 1, 2 * y + i / 2, 2 * x + i % 2);
            lit[i] = lit[i] || place.quarters[l][i].irradiance > 0.0f;
        }
    std::array<bool, 4> open{};
    for (std::size_t i = 0; i < 4; ++i) {
        const std::size_t between =
            std::max(distance(place.y >> (level - 1), 2 * y + i / 2), distance(place.x >> (level - 1), 2 * x + i % 2));
        open[i] = lit[i] && between <= squares_between;
        if (lit[i] && !open[i])
            add_far(place, level - 1, 2 * y + i / 2, 2 * x + i % 2);
    }
    for (std::size_t i = 0; i < 4; ++i)
        if (open[i])
            add_square(place, level - 1, 2 * y + i / 2, 2 * x + i % 2);
}

// Of one of the quarters, as a whole.
void LuminanceProbe::add_far(Place& place, std::size_t level, std::size_t y, std::size_t x) const
{
    // From the middle of the square to the texel, in texels.
    const auto size = static_cast<float>(std::size_t{1} << level);
    const auto away = [&](std::size_t at, std::size_t square) {
        return static_cast<float>(at) - (static_cast<float>(square) + 0.5f) * size + 0.5f;
    };
    const float dx = away(place.x, x);
    const float dy = away(place.y, y);
    const auto unit_x = static_cast<float>(m_pitch_x / m_tables.unit());
    const auto unit_y = static_cast<float>(m_pitch_y / m_tables.unit());
    const float offset_x = dx * unit_x;
    const float offset_y = dy * unit_y;
    const float square = offset_x * offset_x + offset_y * offset_y;
    const float* by_radius = m_tables.at_radius_squared(square);
    if (by_radius == nullptr)
        return;
    // The azimuth of the texel turns by this from the square to the next.
    const float per_square = size / square;
    const float turn_x = unit_x * offset_y * per_square;
    const float turn_y = -unit_y * offset_x * per_square;

    const std::size_t harmonics = m_tables.harmonics();
    std::fill(place.light.begin(), place.light.end(), 0.0f);
    for (const std::array<SquareBeam, 4>& quarters : place.quarters) {
        const SquareBeam& beam = quarters[2 * (y % 2) + x % 2];
        if (beam.irradiance == 0.0f)
            continue;
        const float u = beam.direction.x;
        const float v = beam.direction.y;
        const float lengths = std::sqrt(square * (u * u + v * v));
        const float per_length = lengths > 0.0f ? 1.0f / lengths : 0.0f;
        const float cosine = lengths > 0.0f ? (offset_x * u + offset_y * v) * per_length : 1.0f;
        const float sine = (offset_y * u - offset_x * v) * per_length;
        multiple_angles(place.cosine.data(), place.sine.data(), cosine, sine, harmonics);
        // Where all beams travel toward or away from the texel, as below a lamp, nothing turns. Beams that have nothing to
        // do with each other turn by much, but their harmonics don't cancel for that.
        const float seen_x = turn_x - turn_between(quarters[2 * (y % 2)], quarters[2 * (y % 2) + 1]);
        const float seen_y = turn_y - turn_between(quarters[x % 2], quarters[2 + x % 2]);
        const float seen = std::min(seen_x * seen_x + seen_y * seen_y, turn_x * turn_x + turn_y * turn_y);
        const float* left = m_tables.over_turn(std::sqrt(seen));
        multiply(place.mean.data(), place.cosine.data(), left, beam.irradiance, harmonics);
        add_harmonics(place.light.data(), m_tables.at_angle(beam.direction), place.mean.data(),
                      m_tables.columns().data(), m_tables.columns().size());
    }
    const bool nearby = std::max(std::abs(dx), std::abs(dy)) < static_cast<float>(nearby_sources) + 0.5f;
    float* sums = nearby ? place.near.data() : place.far.data();
    const std::size_t functions = m_tables.functions();
    for (std::size_t k = 0; k < m_tables.media(); ++k)
        add_scaled_product(sums + k * functions, place.light.data(), by_radius + k * functions, 1.0f, functions);
}

void LuminanceProbe::add_near(Place& place, std::size_t y, std::size_t x) const
{
    const std::size_t functions = m_tables.functions();
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
                        place.y < y ? -sine : sine, m_tables.harmonics());
        const float* kernels = m_tables.near(distance(place.y, y), distance(place.x, x));
        const float* by_angle = m_tables.at_angle(beam.direction);
        for (const std::vector<float>* phase : {&place.cosine, &place.sine}) {
            std::fill(place.light.begin(), place.light.end(), 0.0f);
            add_harmonics(place.light.data(), by_angle, phase->data(), m_tables.columns().data(),
                          m_tables.columns().size());
            for (std::size_t k = 0; k < m_tables.media(); ++k, kernels += functions)
                add_scaled_product(place.near.data() + k * functions, place.light.data(), kernels, beam.irradiance,
                                   functions);
        }
    }
}

// The mean over those of the 17 x 17 texels that lie on the plane, of light that enters up to 16 texels away.
void LuminanceProbe::add_nearby(Place& place) const
{
    constexpr std::size_t reach = ProbeTables::nearby_reach;
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
    for (std::size_t y = sources(place.y).first; y < sources(place.y).end; ++y)
        for (std::size_t x = sources(place.x).first; x < sources(place.x).end; ++x)
            for (const LightPyramid& light : m_lights) {
                const SquareBeam beam = light.beam(nearby_level, y, x);
                if (beam.irradiance == 0.0f)
                    continue;
                const float* by_angle = m_tables.at_angle(beam.direction);
                // The window as seen from the source.
                const ProbeTables::Window seen{
                    window_y.first + reach - nearby_side * y, window_y.end + reach - nearby_side * y,
                    window_x.first + reach - nearby_side * x, window_x.end + reach - nearby_side * x};
                for (std::size_t k = 0; k < m_tables.media(); ++k)
                    for (std::size_t rank = 0; rank < m_tables.nearby_ranks(); ++rank)
                        place.nearby[k] += static_cast<double>(beam.irradiance * by_angle[m_tables.start(rank)]) /
                                           texels * m_tables.nearby(k, rank, seen);
            }
}

}  // namespace beamspread
