#include "solve/term_choice/luminance_probe.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simd/loops.h"
#include "solve/term_choice/probe_loops.h"

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

struct LuminanceProbe::Span {
    std::size_t first;
    std::size_t end;

    // Those of `count` that are no farther away than `reach`.
    static Span around(std::size_t at, std::size_t count, std::size_t reach)
    {
        return {at - std::min(at, reach), std::min(count, at + reach + 1)};
    }
};

struct LuminanceProbe::Place {
    Place(const ProbeTables& tables, std::size_t at_y, std::size_t at_x)
        : y(at_y),
          x(at_x),
          near(tables.media() * tables.functions()),
          far(near.size()),
          light(tables.functions()),
          cosine(tables.harmonics()),
          sine(tables.harmonics()),
          nearby(tables.media()),
          means(FarBeams::most * tables.harmonics())
    {
    }

    std::size_t y;
    std::size_t x;
    AlignedVector<float> near;   // [medium][rank][m]: by light from up to `nearby_sources` away
    AlignedVector<float> far;    // and from beyond
    AlignedVector<float> light;  // of a texel by rank and harmonic
    AlignedVector<float> cosine;
    AlignedVector<float> sine;
    std::vector<double> nearby;
    std::array<FarBeams, 2> beams;  // to be added to `far`, to `near`
    AlignedVector<float> means;       // [beam][m]: of cosines over squares
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

bool LuminanceProbe::dark(std::size_t level, const Span& rows, const Span& columns) const
{
    for (std::size_t y = rows.first; y < rows.end; ++y)
        for (std::size_t x = columns.first; x < columns.end; ++x)
            for (const LightPyramid& light : m_lights)
                if (light.beam(level, y, x).irradiance > 0.0f)
                    return false;
    return true;
}

LuminanceProbe::Reading LuminanceProbe::read(std::size_t y, std::size_t x) const
{
    const std::size_t functions = m_tables.functions();
    Place place(m_tables, y, x);
    // Level by level, squares that are too near to be looked at as a whole are looked at by quarters.
    for (std::size_t level = m_lights.front().top(); level > 0; --level) {
        const Span rows = Span::around(y >> level, LightPyramid::squares(m_height, level), squares_between);
        const Span columns = Span::around(x >> level, LightPyramid::squares(m_width, level), squares_between);
        if (dark(level, rows, columns))
            break;
        for (std::size_t row = rows.first; row < rows.end; ++row)
            for (std::size_t column = columns.first; column < columns.end; ++column)
                add_quarters(place, level - 1, row, column);
    }
    add_far(place, false);
    add_far(place, true);
    const Span rows = Span::around(y, m_height, squares_between);
    const Span columns = Span::around(x, m_width, squares_between);
    for (std::size_t row = rows.first; row < rows.end; ++row)
        for (std::size_t column = columns.first; column < columns.end; ++column)
            add_near(place, row, column);
    add_nearby(place);
    Reading reading{{}, std::move(place.nearby)};
    for (std::size_t k = 0; k < m_tables.media(); ++k) {
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

// Of those quarters of a square that are far enough to be looked at as a whole.
void LuminanceProbe::add_quarters(Place& place, std::size_t level, std::size_t y, std::size_t x) const
{
    const auto size = static_cast<float>(std::size_t{1} << level);
    const auto unit_x = static_cast<float>(m_pitch_x / m_tables.unit());
    const auto unit_y = static_cast<float>(m_pitch_y / m_tables.unit());
    const auto squares = [&](std::size_t at, std::size_t square) {
        return std::array<std::size_t, 2>{distance(at >> level, 2 * square), distance(at >> level, 2 * square + 1)};
    };
    // From the middle of a square to the texel, in texels.
    const auto away = [&](std::size_t at, std::size_t square) {
        const float first = static_cast<float>(at) - (static_cast<float>(2 * square) + 0.5f) * size + 0.5f;
        return std::array<float, 2>{first, first - size};
    };
    const std::array<std::size_t, 2> rows = squares(place.y, y);
    const std::array<std::size_t, 2> columns = squares(place.x, x);
    const std::array<float, 2> dx = away(place.x, x);
    const std::array<float, 2> dy = away(place.y, y);
    std::array<bool, 4> seen;
    std::array<bool, 4> nearby;
    for (std::size_t i = 0; i < 4; ++i) {
        const float offset_x = dx[i % 2] * unit_x;
        const float offset_y = dy[i / 2] * unit_y;
        seen[i] = std::max(rows[i / 2], columns[i % 2]) > squares_between &&
                  !m_tables.out_of_reach(offset_x * offset_x + offset_y * offset_y);
        nearby[i] = std::max(std::abs(dx[i % 2]), std::abs(dy[i / 2])) < static_cast<float>(nearby_sources) + 0.5f;
    }
    if (std::find(seen.begin(), seen.end(), true) == seen.end())
        return;
    for (const LightPyramid& light : m_lights) {
        const std::array<SquareBeam, 4> quarters = light.quarters(level, y, x);
        const std::array<float, 2> turn_x = {turn_between(quarters[0], quarters[1]),
                                             turn_between(quarters[2], quarters[3])};
        const std::array<float, 2> turn_y = {turn_between(quarters[0], quarters[2]),
                                             turn_between(quarters[1], quarters[3])};
        for (std::size_t i = 0; i < 4; ++i) {
            const SquareBeam& beam = quarters[i];
            if (!seen[i] || beam.irradiance == 0.0f)
                continue;
            FarBeams& beams = place.beams[nearby[i]];
            if (beams.count == FarBeams::most)
                add_far(place, nearby[i]);
            const std::size_t next = beams.count++;
            beams.x[next] = dx[i % 2] * unit_x;
            beams.y[next] = dy[i / 2] * unit_y;
            beams.width[next] = size * unit_x;
            beams.height[next] = size * unit_y;
            beams.irradiance[next] = beam.irradiance;
            beams.u[next] = beam.direction.x;
            beams.v[next] = beam.direction.y;
            beams.w[next] = beam.direction.z;
            beams.turn_x[next] = turn_x[i / 2];
            beams.turn_y[next] = turn_y[i % 2];
        }
    }
}

// What was collected, to the light from near or from far.
void LuminanceProbe::add_far(Place& place, bool nearby) const
{
    FarBeams& beams = place.beams[nearby];
    find_views(beams);
    for (std::size_t i = 0; i < beams.count; ++i) {
        beams.by_radius[i] = m_tables.at_radius(static_cast<std::size_t>(beams.radius_step[i]));
        beams.by_turn[i] = m_tables.over_turn(beams.turn[i]);
        beams.by_angle[i] = m_tables.at_half_tangent(beams.half_tangent[i]);
    }
    add_far_beams(nearby ? place.near.data() : place.far.data(), beams, m_tables.blocks(), place.means.data(),
                  m_tables.harmonics());
    beams.count = 0;
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
        for (const AlignedVector<float>* phase : {&place.cosine, &place.sine}) {
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
    // Squares whose middle lies that near.
    const auto sources = [](std::size_t at) {
        return Span{(at + 2 - std::min(at + 2, nearby_sources)) / nearby_side, (at + nearby_sources + 2) / nearby_side};
    };
    const Span window_y = Span::around(place.y, m_height, nearby_texels);
    const Span window_x = Span::around(place.x, m_width, nearby_texels);
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
