#include "ldf/radial/radial_function.h"

#include <algorithm>
#include <cmath>

#include "base/constants.h"
#include "base/threads.h"
#include "ldf/radial/radial_profile.h"

namespace beamspread {

namespace {

// Distance from which a disk counts as a point, over its radius. Larger: the border integral becomes a small difference
// of large numbers; smaller: g is less even over the disk.
constexpr double far_in_radii = 1000.0;

// c_m at r, by a central difference of C_m.
Harmonics point_value(const RadialFunction& point, double r)
{
    constexpr double step = 5e-4;  // over r; larger: less rounding, more truncation error
    const Harmonics inner = point.remaining(r * (1.0 - step));
    const Harmonics outer = point.remaining(r * (1.0 + step));
    Harmonics value{};
    for (std::size_t m = 0; m < point.harmonics(); ++m)
        value[m] = (inner[m] - outer[m]) / (2.0 * step * r * r);
    return value;
}

// Radii between which the disk's means are smooth: its border touches a border of the profile's radius bins there. They
// are denser toward the disk's edge, where the singularity at the pole shows.
std::vector<double> breakpoints(double radius, double support)
{
    std::vector<double> radii{0.0, radius, radius + support};
    const auto add_offset = [&](double offset) {
        for (const double r : {radius - offset, radius + offset, offset - radius})
            if (r > 0.0 && r < radius + support)
                radii.push_back(r);
    };
    constexpr double ratio = 1.2;  // of neighbouring radii's distances to the edge; larger: less exact, less time
    const double finest = std::max(1e-6 * radius, std::min(1e-3 * radius, 1e-3));
    const int steps = static_cast<int>(std::ceil(std::log(std::max(1.0, support / finest)) / std::log(ratio)));
    for (int i = 0; i < steps; ++i)
        add_offset(finest * std::pow(ratio, i));
    for (std::size_t k = 0; k < edge_count && radial_edge(k) < support; ++k) {
        add_offset(radial_edge(k));
        if (radial_edge(k) > 2.0 * radius)
            radii.push_back(radial_edge(k));
    }
    std::sort(radii.begin(), radii.end());
    // Remove radii that differ by rounding alone.
    constexpr double rounding = 1e-9;
    radii.erase(
        std::unique(radii.begin(), radii.end(), [&](double a, double b) { return b - a < rounding * (radius + b); }),
        radii.end());
    return radii;
}

// Integral of the half chord sqrt(radius^2 - x^2) from 0 to x.
double chord_integral(double radius, double x)
{
    const double inside = std::clamp(x, -radius, radius);
    return 0.5 * (inside * std::sqrt(radius * radius - inside * inside) + radius * radius * std::asin(inside / radius));
}

// Area of the disk between x0 and x1 and below y, minus the area of its lower half there.
double area_below(double radius, double x0, double x1, double y)
{
    const double sign = y < 0.0 ? -1.0 : 1.0;
    const auto chords = [radius](double from, double to) {
        return chord_integral(radius, to) - chord_integral(radius, from);
    };
    if (std::abs(y) >= radius)
        return sign * chords(x0, x1);
    // Between -cut and cut, chords reach beyond |y|.
    const double cut = std::sqrt(radius * radius - y * y);
    const double from = std::clamp(x0, -cut, cut);
    const double to = std::clamp(x1, -cut, cut);
    return y * (to - from) + sign * (chords(x0, std::min(x1, -cut)) * (x0 < -cut ? 1.0 : 0.0) +
                                     chords(std::max(x0, cut), x1) * (x1 > cut ? 1.0 : 0.0));
}

}  // namespace

Harmonics disk_mean(const RadialFunction& point, double radius, double s)
{
    if (s > far_in_radii * radius)
        return point_value(point, s);
    Harmonics sum{};
    // Near the pole integrate C_m itself; elsewhere C_m - C_m(infinity), as constants cancel around a closed border.
    const bool near = s < 2.0 * radius;
    // Substitute tau = a sinh(x), with tau the angle at the disk's centre from the point nearest to the pole: steps are
    // short near that point. The bound on `a` serves points on the disk's edge.
    const double a = std::max(1e-4, std::abs(radius - s) / std::sqrt(std::max(s, 1e-12 * radius) * radius));
    const double last = std::asinh(pi / a);
    // Choose the number of panels: at most half a period of the shortest harmonic each, and at least 16.
    const double step = 3.2 / static_cast<double>(point.harmonics());
    const int panels = std::max(16, static_cast<int>(std::ceil(last / step)));
    const double half = 0.5 * last / panels;
    for (int i = 0; i < panels; ++i) {
        for (std::size_t q = 0; q < gauss_node.size(); ++q) {
            const double x = half * (2 * i + 1 + gauss_node[q]);
            const double tau = a * std::sinh(x);
            const double sine = std::sin(0.5 * tau);
            const double r2 = (radius - s) * (radius - s) + 4.0 * s * radius * sine * sine;
            const double r = std::sqrt(r2);
            if (r == 0.0)
                continue;
            // Compute the weight d phi / d tau * d tau / dx, twice for both halves of the border.
            const double phi_slope = radius * (radius - s + 2.0 * s * sine * sine) / r2;
            const double weight = 2.0 * gauss_weight[q] * half * a * std::cosh(x) * phi_slope;
            const double cos_phi = (s - radius * std::cos(tau)) / r;
            const Harmonics radial = near ? point.cumulative(r) : point.remaining(r);
            double previous = cos_phi;
            double cosine = 1.0;
            for (std::size_t m = 0; m < point.harmonics(); ++m) {
                sum[m] += (near ? weight : -weight) * radial[m] * cosine;
                const double next = 2.0 * cos_phi * cosine - previous;
                previous = cosine;
                cosine = next;
            }
        }
    }
    for (double& value : sum)
        value /= pi * radius * radius;
    return sum;
}

DiskProfile::DiskProfile(const RadialFunction& point, double radius)
    : m_harmonics(point.harmonics()),
      m_edge(radius),
      m_radii(breakpoints(radius, point.support())),
      m_remaining(m_radii.size(), Harmonics{}),
      m_slope(m_radii.size(), Harmonics{})
{
    std::vector<Harmonics> power(m_radii.size(), Harmonics{});  // of the ring that ends at each radius
    parallel_for(m_radii.size() - 1, [&](std::size_t k) {
        const double r = m_radii[k];
        const double half = 0.5 * (m_radii[k + 1] - r);
        for (std::size_t q = 0; q < gauss_node.size(); ++q) {
            const double s = r + half * (1.0 + gauss_node[q]);
            const Harmonics mean = disk_mean(point, radius, s);
            for (std::size_t m = 0; m < m_harmonics; ++m)
                power[k + 1][m] += gauss_weight[q] * half * s * mean[m];
        }
        m_slope[k] = disk_mean(point, radius, r);
        for (double& slope : m_slope[k])
            slope *= r;
    });
    for (std::size_t k = m_radii.size() - 1; k-- > 0;)
        for (std::size_t m = 0; m < m_harmonics; ++m)
            m_remaining[k][m] = m_remaining[k + 1][m] + power[k + 1][m];

    // Scale the sums, which are made by quadrature, to the known total.
    const double total = point.cumulative(point.support())[0];
    if (m_remaining[0][0] == 0.0)
        return;
    const double correction = total / m_remaining[0][0];
    for (std::vector<Harmonics>* values : {&m_remaining, &m_slope})
        for (Harmonics& at : *values)
            for (double& value : at)
                value *= correction;
}

Harmonics DiskProfile::remaining(double r) const
{
    Harmonics out{};
    if (r >= m_radii.back())
        return out;
    const auto above = std::upper_bound(m_radii.begin() + 1, m_radii.end() - 1, r);
    const auto k = static_cast<std::size_t>(above - m_radii.begin());
    const double h = m_radii[k] - m_radii[k - 1];
    const double t = (r - m_radii[k - 1]) / h;
    // Evaluate the cubic Hermite polynomials.
    const double v1 = t * t * (3.0 - 2.0 * t);
    const double s0 = t * (1.0 - t) * (1.0 - t) * h;
    const double s1 = t * t * (t - 1.0) * h;
    for (std::size_t m = 0; m < m_harmonics; ++m)
        out[m] =
            (1.0 - v1) * m_remaining[k - 1][m] + v1 * m_remaining[k][m] - s0 * m_slope[k - 1][m] - s1 * m_slope[k][m];
    return out;
}

Harmonics DiskProfile::cumulative(double r) const
{
    Harmonics out = remaining(r);
    for (std::size_t m = 0; m < m_harmonics; ++m)
        out[m] = m_remaining[0][m] - out[m];
    return out;
}

double disk_overlap(double radius, double x0, double x1, double y0, double y1)
{
    return area_below(radius, x0, x1, y1) - area_below(radius, x0, x1, y0);
}

}  // namespace beamspread
