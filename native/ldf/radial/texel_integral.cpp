#include "ldf/radial/radial_function.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/constants.h"
#include "base/error.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Largest step of asinh(s / distance) along a border: a fifth of the radius, about the width of a radius bin, and half
// a period of the shortest harmonic, which the Gauss rule integrates to 1e-5.
double max_border_step(const RadialFunction& profile)
{
    return std::min(0.2, 3.2 / static_cast<double>(profile.harmonics()));
}

struct BorderIntegral {
    explicit BorderIntegral(std::size_t count) : harmonics(count) {}

    std::size_t harmonics;
    Harmonics cosine{};
    Harmonics sine{};

    void add(const Harmonics& radial, double cos_phi, double sin_phi, double weight)
    {
        double c = weight;
        double s = 0.0;
        for (std::size_t m = 0; m < harmonics; ++m) {
            cosine[m] += radial[m] * c;
            sine[m] += radial[m] * s;
            const double next = c * cos_phi - s * sin_phi;
            s = s * cos_phi + c * sin_phi;
            c = next;
        }
    }

    void add(const BorderIntegral& integral, double sign)
    {
        for (std::size_t m = 0; m < harmonics; ++m) {
            cosine[m] += sign * integral.cosine[m];
            sine[m] += sign * integral.sine[m];
        }
    }
};

enum class Radial { remaining, cumulative };

// Integral over a straight border of F_m(r) (cos, sin)(m phi) d phi. The border runs from s0 to s1 along a unit vector
// at `distance` (>= 0) from the pole, which lies on its left (sense 1) or right (-1); point(s) gives (x, y).
template <class Point>
BorderIntegral integrate_piece(const RadialFunction& profile, Radial radial, double distance, double s0, double s1,
                               double sense, const Point& point)
{
    BorderIntegral sum(profile.harmonics());
    if (distance == 0.0)
        return sum;  // d phi = 0 along a line through the pole
    const double nearest = std::hypot(distance, s0 * s1 <= 0.0 ? 0.0 : std::min(std::abs(s0), std::abs(s1)));
    if (radial == Radial::remaining && nearest >= profile.support())
        return sum;
    const auto add = [&](double s, double r2, double weight) {
        const double r = std::sqrt(r2);
        const auto [x, y] = point(s);
        sum.add(radial == Radial::remaining ? profile.remaining(r) : profile.cumulative(r), x / r, y / r, weight);
    };
    const double max_step = max_border_step(profile);
    if (std::abs(s1 - s0) < max_step * nearest) {
        const double half = 0.5 * (s1 - s0);
        for (std::size_t q = 0; q < gauss_node.size(); ++q) {
            const double s = 0.5 * (s0 + s1) + half * gauss_node[q];
            const double r2 = s * s + distance * distance;
            add(s, r2, gauss_weight[q] * half * sense * distance / r2);
        }
        return sum;
    }
    // Substitute s = distance sinh(t), r = distance cosh(t), d phi = dt / cosh(t): the integrand is as smooth near the
    // foot of the perpendicular as far from it.
    const double t0 = std::asinh(s0 / distance);
    const double t1 = std::asinh(s1 / distance);
    const int steps = static_cast<int>(std::ceil(std::abs(t1 - t0) / max_step));
    const double half = 0.5 * (t1 - t0) / steps;
    for (int i = 0; i < steps; ++i) {
        for (std::size_t q = 0; q < gauss_node.size(); ++q) {
            const double t = t0 + half * (2 * i + 1 + gauss_node[q]);
            const double c = std::cosh(t);
            add(distance * std::sinh(t), distance * distance * c * c, gauss_weight[q] * half * sense / c);
        }
    }
    return sum;
}

// Integral over a border, divided where it crosses the profile's edge.
template <class Point>
BorderIntegral integrate_border(const RadialFunction& profile, Radial radial, double distance, double s0, double s1,
                                double sense, const Point& point)
{
    if (!(distance < profile.edge()))
        return integrate_piece(profile, radial, distance, s0, s1, sense, point);
    const double chord = std::sqrt(profile.edge() * profile.edge() - distance * distance);
    BorderIntegral sum(profile.harmonics());
    double from = s0;
    for (const double to : {std::clamp(-chord, s0, s1), std::clamp(chord, s0, s1), s1}) {
        if (to > from)
            sum.add(integrate_piece(profile, radial, distance, from, to, sense, point), 1.0);
        from = to;
    }
    return sum;
}

// Integral over the border along +x at height y, from x0 to x1.
BorderIntegral horizontal(const RadialFunction& profile, Radial radial, double y, double x0, double x1)
{
    return integrate_border(profile, radial, std::abs(y), x0, x1, y > 0.0 ? -1.0 : 1.0,
                            [y](double s) { return std::pair(s, y); });
}

// Integral over the border along +y at x, from y0 to y1.
BorderIntegral vertical(const RadialFunction& profile, Radial radial, double x, double y0, double y1)
{
    return integrate_border(profile, radial, std::abs(x), y0, y1, x > 0.0 ? 1.0 : -1.0,
                            [x](double s) { return std::pair(x, s); });
}

}  // namespace

void check_pitch(double pitch)
{
    if (!(pitch >= 1e-6 && pitch <= 1e18))
        reject("pitch", pitch, "1e-6 <= pitch <= 1e18 mean free paths");
}

TexelIntegrals integrate_texels(const RadialFunction& profile, const TexelGrid& grid)
{
    const std::size_t texels = grid.width * grid.height;
    TexelIntegrals out(profile.harmonics(), texels);
    // Snap borders to the pole that miss it by rounding alone.
    const double rounding = 1e-9 * std::min(grid.pitch_x, grid.pitch_y);
    const auto snapped = [rounding](double x) { return std::abs(x) < rounding ? 0.0 : x; };
    const auto x_at = [&](std::size_t j) { return snapped(grid.x0 + static_cast<double>(j) * grid.pitch_x); };
    const auto y_at = [&](std::size_t i) { return snapped(grid.y0 + static_cast<double>(i) * grid.pitch_y); };

    const auto store = [&](std::size_t i, std::size_t j, const BorderIntegral& value, double sign) {
        const std::size_t texel = i * grid.width + j;
        for (std::size_t m = 0; m < out.harmonics; ++m) {
            out.cosine[m * texels + texel] = sign * value.cosine[m];
            out.sine[m * texels + texel] = sign * value.sine[m];
        }
    };

    constexpr std::size_t rows_per_block = 16;  // texel rows per work item; more: fewer borders twice, less to share
    const std::size_t blocks = (grid.height + rows_per_block - 1) / rows_per_block;
    parallel_for(blocks, [&](std::size_t block) {
        const std::size_t first = block * rows_per_block;
        const std::size_t last = std::min(grid.height, first + rows_per_block);
        const auto horizontal_borders = [&](std::size_t i) {
            std::vector<BorderIntegral> borders(grid.width, BorderIntegral(0));
            for (std::size_t j = 0; j < grid.width; ++j)
                borders[j] = horizontal(profile, Radial::remaining, y_at(i), x_at(j), x_at(j + 1));
            return borders;
        };
        std::vector<BorderIntegral> below = horizontal_borders(first);
        for (std::size_t i = first; i < last; ++i) {
            std::vector<BorderIntegral> above = horizontal_borders(i + 1);
            const double y0 = y_at(i);
            const double y1 = y_at(i + 1);
            BorderIntegral left = vertical(profile, Radial::remaining, x_at(0), y0, y1);
            for (std::size_t j = 0; j < grid.width; ++j) {
                const double x0 = x_at(j);
                const double x1 = x_at(j + 1);
                const BorderIntegral right = vertical(profile, Radial::remaining, x1, y0, y1);
                if (x0 <= 0.0 && x1 >= 0.0 && y0 <= 0.0 && y1 >= 0.0) {
                    // The pole is inside the texel or on its border, where the remaining power does not vanish.
                    BorderIntegral sum = horizontal(profile, Radial::cumulative, y0, x0, x1);
                    sum.add(vertical(profile, Radial::cumulative, x1, y0, y1), 1.0);
                    sum.add(horizontal(profile, Radial::cumulative, y1, x0, x1), -1.0);
                    sum.add(vertical(profile, Radial::cumulative, x0, y0, y1), -1.0);
                    store(i, j, sum, 1.0);
                } else {
                    BorderIntegral sum = below[j];
                    sum.add(right, 1.0);
                    sum.add(above[j], -1.0);
                    sum.add(left, -1.0);
                    store(i, j, sum, -1.0);
                }
                left = right;
            }
            below = std::move(above);
        }
    });
    return out;
}

}  // namespace beamspread
