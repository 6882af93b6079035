#include "ldf/radial/radial_profile.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"

namespace beamspread {

namespace {

// Weights of the values at five neighbouring knots, from `first`, in the derivative of their polynomial at one of them.
struct Stencil {
    std::size_t first = 0;
    std::array<double, 5> weight{};
};

// Edges at which the cubics meet.
struct Knots {
    std::vector<std::size_t> edge;
    std::vector<Stencil> stencil;
};

Stencil derivative_stencil(const std::vector<std::size_t>& knots, std::size_t i)
{
    Stencil stencil;
    stencil.first = std::clamp<std::size_t>(i, 2, knots.size() - 3) - 2;
    std::array<double, 5> r{};
    for (std::size_t j = 0; j < 5; ++j)
        r[j] = radial_edge(knots[stencil.first + j]);
    const double here = radial_edge(knots[i]);
    for (std::size_t n = 0; n < 5; ++n) {
        double derivative = 0.0;  // of Lagrange's n-th polynomial at r[k]
        for (std::size_t skip = 0; skip < 5; ++skip) {
            if (skip == n)
                continue;
            double product = 1.0 / (r[n] - r[skip]);
            for (std::size_t j = 0; j < 5; ++j)
                if (j != n && j != skip)
                    product *= (here - r[j]) / (r[n] - r[j]);
            derivative += product;
        }
        stencil.weight[n] = derivative;
    }
    return stencil;
}

const Knots& knots(RadialDetail detail)
{
    static const auto tables = [] {
        std::array<Knots, 2> all;
        for (const RadialDetail fineness : {RadialDetail::bins, RadialDetail::all}) {
            auto& [edge, stencil] = all[static_cast<std::size_t>(fineness)];
            for (std::size_t k = 0; k < edge_count; ++k)
                if (fineness == RadialDetail::all || is_bin_edge(k))
                    edge.push_back(k);
            for (std::size_t i = 0; i < edge.size(); ++i)
                stencil.push_back(derivative_stencil(edge, i));
        }
        return all;
    }();
    return tables[static_cast<std::size_t>(detail)];
}

// Factors of the values (v) and slopes (s) at a bin's edges in its cubic Hermite polynomial, or in the derivative, at t
// in [0, 1] of the bin's width h.
struct Cubic {
    double v0, v1, s0, s1;
};

Cubic cubic_value(double t, double h)
{
    const double t2 = t * t;
    const double t3 = t2 * t;
    return {2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, (t3 - 2.0 * t2 + t) * h, (t3 - t2) * h};
}

Cubic cubic_derivative(double t, double h)
{
    const double t2 = t * t;
    return {6.0 * (t2 - t) / h, 6.0 * (t - t2) / h, 3.0 * t2 - 4.0 * t + 1.0, 3.0 * t2 - 2.0 * t};
}

}  // namespace

RadialProfile::RadialProfile() : m_remaining(edge_count, Harmonics{}), m_slope(edge_count, Harmonics{}) {}

RadialProfile::RadialProfile(double centre, std::span<const double> bin_moments, RadialDetail detail, RadialEnd end)
    : RadialProfile()
{
    m_detail = detail;
    m_centre = centre;
    const std::vector<std::size_t>& knot = knots(detail).edge;
    m_harmonics = bin_moments.size() / knot.size();
    // 1 / integral of cos^2(m phi) over the circle, which is 2 pi for m = 0 and pi above.
    const auto norm = [](std::size_t m) { return m == 0 ? inv_pi / 2.0 : inv_pi; };
    // Sum from outside in: the small remainders far out must not be differences of large sums.
    Harmonics sum{};
    for (std::size_t i = knot.size(); i-- > 0;) {
        m_remaining[knot[i]] = sum;
        for (std::size_t m = 0; m < m_harmonics; ++m)
            sum[m] += norm(m) * bin_moments[m * knot.size() + i];
    }
    m_total = sum;

    for (std::size_t i = 0; i + 1 < knot.size(); ++i) {
        const std::size_t k = knot[i];
        m_slope[k] = slope_at(i, detail, end);
        // Limit the slopes to three times those of the adjacent chords, which makes C_0 monotone and the azimuthal mean
        // of g positive (Fritsch, Carlson 1980, doi:10.1137/0717021).
        const auto chord = [&](std::size_t at) {
            return at == 0 ? (m_total[0] - m_remaining[0][0]) / radial_edge(0)
                           : (m_remaining[knot[at - 1]][0] - m_remaining[knot[at]][0]) /
                                 (radial_edge(knot[at]) - radial_edge(knot[at - 1]));
        };
        const double limit = 3.0 * std::min(chord(i), chord(i + 1));
        m_slope[k][0] = std::clamp(m_slope[k][0], 0.0, std::max(0.0, limit));
    }
    for (std::size_t i = 1; i < knot.size(); ++i)
        subdivide(knot[i - 1], knot[i]);
    update_support();
}

// Evaluates the cubic between two knots at the edges between them.
void RadialProfile::subdivide(std::size_t first, std::size_t last)
{
    const double start = radial_edge(first);
    const double h = radial_edge(last) - start;
    for (std::size_t k = first + 1; k < last; ++k) {
        const double t = (radial_edge(k) - start) / h;
        const Cubic value = cubic_value(t, h);
        const Cubic slope = cubic_derivative(t, h);
        for (std::size_t m = 0; m < m_harmonics; ++m) {
            m_remaining[k][m] = value.v0 * m_remaining[first][m] + value.v1 * m_remaining[last][m] -
                                value.s0 * m_slope[first][m] - value.s1 * m_slope[last][m];
            m_slope[k][m] = slope.s0 * m_slope[first][m] + slope.s1 * m_slope[last][m] -
                            slope.v0 * m_remaining[first][m] - slope.v1 * m_remaining[last][m];
        }
    }
}

// Slopes of C_m at knot i. Far out g falls exponentially, by several times within a bin. A polynomial follows the
// logarithm of the remaining power of m = 0 well, and the profile harmonics' ratios to it. Beside an abrupt end, where the
// remaining power is no exponential, a parabola through three knots follows it.
Harmonics RadialProfile::slope_at(std::size_t i, RadialDetail detail, RadialEnd end) const
{
    const auto& [edge, stencils] = knots(detail);
    const Stencil& stencil = stencils[i];
    Harmonics slope{};
    const Harmonics& here = m_remaining[edge[i]];
    for (std::size_t j = 0; j < 5; ++j)
        if (m_remaining[edge[stencil.first + j]][0] <= 0.0) {
            // beside the last bin with light, or noise of subtracted profiles
            if (end == RadialEnd::abrupt && here[0] > 0.0 && i > 0)
                for (std::size_t m = 0; m < m_harmonics; ++m)
                    slope[m] = parabola_slope(i, edge, m);
            return slope;
        }
    for (std::size_t j = 0; j < 5; ++j) {
        const Harmonics& there = m_remaining[edge[stencil.first + j]];
        slope[0] -= stencil.weight[j] * here[0] * std::log(there[0] / here[0]);
        for (std::size_t m = 1; m < m_harmonics; ++m)
            slope[m] -= stencil.weight[j] * here[0] * there[m] / there[0];
    }
    for (std::size_t m = 1; m < m_harmonics; ++m)
        slope[m] += here[m] / here[0] * slope[0];
    return slope;
}

// Slope of C_m at an inner knot, of the parabola through it and its neighbours.
double RadialProfile::parabola_slope(std::size_t i, std::span<const std::size_t> edge, std::size_t m) const
{
    const double before = radial_edge(edge[i]) - radial_edge(edge[i - 1]);
    const double after = radial_edge(edge[i + 1]) - radial_edge(edge[i]);
    const double chord_before = (m_remaining[edge[i - 1]][m] - m_remaining[edge[i]][m]) / before;
    const double chord_after = (m_remaining[edge[i]][m] - m_remaining[edge[i + 1]][m]) / after;
    return (after * chord_before + before * chord_after) / (before + after);
}

void RadialProfile::add(const RadialProfile& profile, double even_weight, double odd_weight)
{
    Harmonics weights{};
    for (std::size_t m = 0; m < profile.m_harmonics; ++m)
        weights[m] = m % 2 == 0 ? even_weight : odd_weight;
    add(profile, weights);
}

void RadialProfile::add(const RadialProfile& profile, const Harmonics& weights)
{
    for (std::size_t m = 0; m < profile.m_harmonics; ++m) {
        if (weights[m] == 0.0)
            continue;
        m_harmonics = std::max(m_harmonics, m + 1);
        m_total[m] += weights[m] * profile.m_total[m];
        for (std::size_t k = 0; k < edge_count; ++k) {
            m_remaining[k][m] += weights[m] * profile.m_remaining[k][m];
            m_slope[k][m] += weights[m] * profile.m_slope[k][m];
        }
    }
    m_support = std::max(m_support, profile.m_support);
    m_detail = std::max(m_detail, profile.m_detail);
}

void RadialProfile::keep_harmonics(std::size_t count)
{
    for (; m_harmonics > count; --m_harmonics) {
        const std::size_t m = m_harmonics - 1;
        m_total[m] = 0.0;
        for (std::size_t k = 0; k < edge_count; ++k)
            m_remaining[k][m] = m_slope[k][m] = 0.0;
    }
}

std::size_t RadialProfile::harmonics_beyond(double r, double power) const
{
    double moved = 0.0;
    std::size_t count = m_harmonics;
    for (; count > 1; --count) {
        const std::size_t m = count - 1;
        for (std::size_t k = 0; k < edge_count; ++k)
            if (radial_edge(k) > r)
                moved += std::abs((k == 0 ? m_total[m] : m_remaining[k - 1][m]) - m_remaining[k][m]);
        if (4.0 * moved > power)  // |cos(m phi)| integrates to 4 over the circle
            break;
    }
    return count;
}

void RadialProfile::drop_negligible(double fraction)
{
    keep_harmonics(harmonics_beyond(0.0, fraction * total()));
}

void RadialProfile::update_support()
{
    std::size_t k = edge_count - 1;
    while (k > 0 && m_remaining[k - 1][0] <= 0.0)
        --k;
    m_support = radial_edge(k);
}

Harmonics RadialProfile::remaining(double r) const
{
    Harmonics out{};
    if (r >= m_support)
        return out;
    const std::size_t k = edge_beyond(static_cast<float>(r));
    if (k == 0) {
        // Inside the first edge C_m is linear: single scattering makes g grow like 1 / r toward the point of entry.
        const double t = std::min(1.0, r / radial_edge(0));
        for (std::size_t m = 0; m < m_harmonics; ++m)
            out[m] = m_total[m] + t * (m_remaining[0][m] - m_total[m]);
        return out;
    }
    const double h = radial_edge(k) - radial_edge(k - 1);
    const Cubic c = cubic_value((r - radial_edge(k - 1)) / h, h);
    for (std::size_t m = 0; m < m_harmonics; ++m)
        out[m] =
            c.v0 * m_remaining[k - 1][m] + c.v1 * m_remaining[k][m] - c.s0 * m_slope[k - 1][m] - c.s1 * m_slope[k][m];
    return out;
}

Harmonics RadialProfile::density(double r) const
{
    Harmonics out{};
    if (r >= m_support)
        return out;
    const std::size_t k = edge_beyond(static_cast<float>(r));
    if (k == 0) {
        for (std::size_t m = 0; m < m_harmonics; ++m)
            out[m] = (m_total[m] - m_remaining[0][m]) / (radial_edge(0) * r);
        return out;
    }
    const double h = radial_edge(k) - radial_edge(k - 1);
    const Cubic c = cubic_derivative((r - radial_edge(k - 1)) / h, h);
    for (std::size_t m = 0; m < m_harmonics; ++m)
        out[m] = (c.s0 * m_slope[k - 1][m] + c.s1 * m_slope[k][m] - c.v0 * m_remaining[k - 1][m] -
                  c.v1 * m_remaining[k][m]) /
                 r;
    return out;
}

Harmonics RadialProfile::cumulative(double r) const
{
    Harmonics out = remaining(r);
    for (std::size_t m = 0; m < m_harmonics; ++m)
        out[m] = m_total[m] - out[m];
    return out;
}

double RadialProfile::reach(double fraction) const
{
    const double allowed = fraction * cumulative(m_support)[0];
    for (std::size_t k = 0; k < edge_count; ++k)
        if (remaining(radial_edge(k))[0] <= allowed)
            return radial_edge(k);
    return m_support;
}

double RadialProfile::total() const
{
    return 2.0 * pi * m_total[0];
}

}  // namespace beamspread
