#include "solve/surface/lattice_excess.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/constants.h"
#include "solve/surface/chord_table.h"

namespace beamspread {

namespace {

// Width of the window in which sums over a lattice are compared with integrals, in its longer steps, and its end in
// widths. Wider: more of the kernel, more time.
constexpr double window_width = 1.0;
constexpr double window_end = 5.0;

// Window at a radius in widths. It is so flat in the middle that it hardly changes the kernel's spectrum.
double window(double radius)
{
    const double half_square = 0.5 * radius * radius;
    return radius < window_end ? (1.0 + half_square) * std::exp(-half_square) : 0.0;
}

// Octaves of the largest ratio of radii; disks are four in an octave.
constexpr double most_ratio = 0.125;

// Shapes per octave of `across`. More: smaller errors in between, more memory.
constexpr int shapes_per_octave = 5;
constexpr double least_across = 0.8660254037844386;  // sqrt(3) / 2
constexpr double most_along = 0.5;

// Radii at which circles around a disk's middle are compared, in roots of its area: the least one, their number for each
// octave and in all, and parts of the step between two. More: smaller errors, more time.
constexpr double first_radius = 0.04;
constexpr std::size_t circles_per_octave = 32;
constexpr std::size_t circle_count = 9 * circles_per_octave;
constexpr std::size_t parts_per_step = 4;

// Coverage over a turn that counts as none, above rounding.
constexpr double least_coverage = 1e-9;

// Radius in roots of the area.
double circle(double number)
{
    return first_radius * std::exp2(number / static_cast<double>(circles_per_octave));
}

// Radius of the neighbors' disks over that of a disk of a sample's area.
double ratio_of(std::size_t layer)
{
    return std::exp2((static_cast<double>(layer) - 1.0) * most_ratio);
}

// Number of disks over circles around one of them less the 1 of a plane, times a window. The other disks have a radius of
// this ratio to the one in the middle, and the same light. Integrals over the azimuth
// times cos and sin(m phi), [circle][m / 2][cosine, sine]; means between two circles.
struct Coverage {
    std::vector<std::array<double, 2 * even_harmonics>> circles =
        std::vector<std::array<double, 2 * even_harmonics>>(circle_count);
    std::size_t begin = circle_count;  // circles that matter
    std::size_t end = 0;

    Coverage(double along, double across, double ratio)
    {
        const double own = std::sqrt(inv_pi);
        const Vec2 x = Vec2(1.0, 0.0) / std::sqrt(across);
        const Vec2 y = Vec2(along, across) / std::sqrt(across);
        const double width = window_width * glm::length(y);
        const double reach = window_end * width;
        const auto rows = static_cast<int>(reach / y.y) + 1;
        const auto columns = static_cast<int>(reach / x.x) + 1;
        add_disk({0.0, 0.0}, own, 1.0);
        for (int row = 0; row <= rows; ++row) {
            const auto shift = static_cast<int>(std::nearbyint(row * along));
            for (int column = -columns; column <= columns; ++column) {
                const Vec2 at = static_cast<double>(column - shift) * x + static_cast<double>(row) * y;
                // Each disk has another one opposite, whose even harmonics are the same.
                if (row > 0 || column > 0)
                    add_disk(at, ratio * own, 2.0 / (ratio * ratio));
            }
        }
        for (std::size_t i = 0; i < circle_count; ++i) {
            circles[i][0] -= 2.0 * pi;
            for (double& value : circles[i])
                value *= window(circle(static_cast<double>(i) + 0.5) / width);
            // Rounding leaves a little where there is one disk alone.
            if (std::abs(circles[i][0]) > least_coverage) {
                begin = std::min(begin, i);
                end = i + 1;
            }
        }
    }

private:
    void add_disk(const Vec2& middle, double disk, double count)
    {
        const double distance = glm::length(middle);
        const double chord = distance > 0.0 ? std::max(distance, static_cast<double>(disk_begin_radii) * disk) : 0.0;
        std::array<Vec2, even_harmonics> turned{Vec2(1.0, 0.0)};
        for (std::size_t h = 1; h < even_harmonics; ++h) {
            const double angle = 2.0 * static_cast<double>(h) * std::atan2(middle.y, middle.x);
            turned[h] = {std::cos(angle), std::sin(angle)};
        }
        const double nearest = std::max(chord - disk, first_radius) / first_radius;
        for (auto i = static_cast<std::size_t>(std::log2(nearest) * circles_per_octave);
             i < circle_count && circle(static_cast<double>(i)) < chord + disk; ++i) {
            for (std::size_t part = 0; part < parts_per_step; ++part) {
                const double within = (static_cast<double>(part) + 0.5) / static_cast<double>(parts_per_step);
                const double radius = circle(static_cast<double>(i) + within);
                // `half` of the arc in the disk; the sines of its multiples follow by Chebyshev's recurrence.
                const double cosine = chord > 0.0
                                          ? (radius * radius + chord * chord - disk * disk) / (2.0 * radius * chord)
                                      : radius < disk ? -1.0
                                                      : 1.0;
                if (cosine >= 1.0)
                    continue;
                const double half = std::acos(std::max(cosine, -1.0));
                const double twice = 2.0 * std::max(cosine, -1.0);
                const double weight = count / static_cast<double>(parts_per_step);
                circles[i][0] += 2.0 * half * weight;
                double last = 0.0;
                double next = std::sin(half);
                for (std::size_t h = 1; h < even_harmonics; ++h) {
                    const double even = twice * next - last;
                    last = next;
                    next = even;
                    const double arc = even / static_cast<double>(h) * weight;
                    circles[i][2 * h] += arc * turned[h].x;
                    circles[i][2 * h + 1] += arc * turned[h].y;
                    const double odd = twice * next - last;
                    last = next;
                    next = odd;
                }
            }
        }
    }
};

// The coverage of all neighborhoods.
const std::vector<Coverage>& coverages()
{
    static const std::vector<Coverage> all = [] {
        std::vector<Coverage> made;
        for (std::size_t n = 0; n < neighborhood_count; ++n) {
            const auto row = static_cast<double>(n / along_count % across_count);
            const auto column = static_cast<double>(n % along_count);
            made.emplace_back(most_along * column / static_cast<double>(along_count - 1),
                              least_across * std::exp2(row / shapes_per_octave),
                              ratio_of(n / (across_count * along_count)));
        }
        return made;
    }();
    return all;
}

}  // namespace

LatticeShape::LatticeShape(Vec2f step_x, Vec2f step_y)
{
    reduce_steps(step_x, step_y);
    const float length = glm::length(step_x);
    if (!(length > 0.0f && std::isfinite(length)))
        return;
    shortest = step_x / length;
    const float next = glm::dot(step_y, shortest) / length;
    const float turned = (step_y.y * shortest.x - step_y.x * shortest.y) / length;
    is_mirrored = (next < 0.0f) != (turned < 0.0f);
    along = std::abs(next);
    across = std::abs(turned);
}

Neighborhoods::Neighborhoods(const LatticeShape& shape, float octaves)
{
    const auto place = [](double value, std::size_t count) {
        const double inside = std::clamp(value, 0.0, static_cast<double>(count - 1));
        const auto before = std::min(static_cast<std::size_t>(inside), count - 2);
        return std::pair(before, static_cast<float>(inside - static_cast<double>(before)));
    };
    const auto [column, x] = place(static_cast<double>(shape.along) / most_along * (along_count - 1), along_count);
    const auto [row, y] =
        place(std::log2(static_cast<double>(shape.across) / least_across) * shapes_per_octave, across_count);
    const auto [layer, z] = place(static_cast<double>(octaves) / most_ratio + 1.0, ratio_count);
    for (std::size_t i = 0; i < index.size(); ++i) {
        index[i] = ((layer + i / 4) * across_count + row + i / 2 % 2) * along_count + column + i % 2;
        weight[i] = (i / 4 == 0 ? 1.0f - z : z) * (i / 2 % 2 == 0 ? 1.0f - y : y) * (i % 2 == 0 ? 1.0f - x : x);
    }
}

std::vector<double> lattice_excess(const RadialProfile& profile, double disk, std::size_t harmonics)
{
    constexpr std::size_t values = 2 * even_harmonics;
    std::vector<double> excess(neighborhood_count * values, 0.0);
    std::vector<std::array<double, values>> rings(circle_count);
    const std::vector<Coverage>& all = coverages();
    for (std::size_t layer = 0; layer < ratio_count; ++layer) {
        const double root = std::sqrt(pi) * disk / ratio_of(layer);
        Harmonics inside = profile.cumulative(root * circle(0.0));
        for (std::size_t i = 0; i < circle_count; ++i) {
            const Harmonics next = profile.cumulative(root * circle(static_cast<double>(i + 1)));
            for (std::size_t v = 0; v < values; ++v)
                rings[i][v] = next[v / 2 * 2] - inside[v / 2 * 2];
            inside = next;
        }
        constexpr std::size_t shapes = across_count * along_count;
        for (std::size_t n = layer * shapes; n < (layer + 1) * shapes; ++n)
            for (std::size_t v = 0; v < 2 * harmonics; ++v) {
                double sum = 0.0;
                for (std::size_t i = all[n].begin; i < all[n].end; ++i)
                    sum += rings[i][v] * all[n].circles[i][v];
                excess[n * values + v] = sum;
            }
    }
    return excess;
}

}  // namespace beamspread
