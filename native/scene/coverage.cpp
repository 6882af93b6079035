#include "scene/coverage.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/threads.h"

namespace beamspread {

namespace {

// Texel rows that a thread fills at a time. More: fewer tests of polygons, less parallel.
constexpr std::size_t rows_per_band = 64;

// Units of height and area per texel, counted in whole numbers: heights of edges that meet add up exactly, so that no
// remainder is left in texels that no edge passes through. The position where an edge enters a texel is rounded by at most
// 5 * 2^-53 of the largest coordinate, 0.04 units in a grid of 65536 texels, so that rounding alone counts as 0. A texel's
// coverage is off by less than one unit for each edge through it.
constexpr double per_texel = 0x1p30;

// Texel rows that lie row_step apart are shifted by the parts of its multiples: evenly, and in step with no pattern of a map.
constexpr double golden_ratio = 0.6180339887498949;

// Length of a piece of an edge along its row, in texels, below which the area beside it is less than a unit.
constexpr double shortest_piece = 1e-12;

// Nearest whole number of a value that is not negative; a value a rounding error below a half may give 1. llrint would be
// a call of the C library at every texel.
std::int64_t nearest(double value)
{
    constexpr double half = 0.5;
    return static_cast<std::int64_t>(value + half);
}

std::int64_t counted(double part)
{
    return nearest(part * per_texel);
}

// Signed area by Green's theorem: each edge adds, to every texel right of it, the height by which it crosses the texel's
// row. Differences along the row are stored, so that an edge changes only the texels that it passes through, and one
// running sum at the end gives the covered part.
class Band {
public:
    Band(std::size_t first_row, std::size_t rows, std::size_t width, std::size_t row_step)
        : m_bottom(static_cast<double>(first_row * row_step)),
          m_step(static_cast<double>(row_step)),
          m_width(static_cast<double>(width)),
          m_stride(width + 1),
          m_row_bottoms(rows),
          m_difference(rows * m_stride, 0)
    {
        for (std::size_t row = 0; row < rows; ++row) {
            const double part = static_cast<double>(first_row + row) * golden_ratio;
            m_row_bottoms[row] = static_cast<double>(row) * m_step + std::floor((part - std::floor(part)) * m_step);
        }
    }

    double bottom() const { return m_bottom; }
    double top() const { return m_bottom + static_cast<double>(m_row_bottoms.size()) * m_step; }

    // Adds an edge, in texels of the grid.
    void add_edge(Vec2 from, Vec2 to, int sign)
    {
        from.y -= m_bottom;
        to.y -= m_bottom;
        if (from.y > to.y) {
            std::swap(from, to);
            sign = -sign;
        }
        const double begin = std::max(from.y, 0.0);
        const double end = std::min(to.y, top() - m_bottom);
        if (!(begin < end))
            return;
        const double slope = (to.x - from.x) / (to.y - from.y);
        const auto x_at = [&](double y) { return from.x + (y - from.y) * slope; };
        for (auto row = static_cast<std::size_t>(begin / m_step); row < m_row_bottoms.size(); ++row) {
            const double y0 = std::max(begin, m_row_bottoms[row]);
            const double y1 = std::min(end, m_row_bottoms[row] + 1.0);
            if (y0 < y1)
                add_in_row(row, x_at(y0), x_at(y1), counted(y1) - counted(y0), sign);
            else if (y0 >= end)
                return;
        }
    }

    void sum_row(std::size_t row, float* coverage, bool is_cut) const
    {
        const std::int64_t* difference = &m_difference[row * m_stride];
        std::int64_t covered = 0;
        for (std::size_t x = 0; x + 1 < m_stride; ++x) {
            covered += difference[x];
            const double part = static_cast<double>(covered) / per_texel;
            coverage[x] = static_cast<float>(is_cut ? std::clamp(part, 0.0, 1.0) : part);
        }
    }

private:
    // Adds a piece of an edge within one row, which rises by `height` from x0 to x1. It covers a texel by its mean height
    // there, which is that at the texel's centre where it passes through the whole texel.
    void add_in_row(std::size_t row, double x0, double x1, std::int64_t height, int sign)
    {
        if (x0 > x1)
            std::swap(x0, x1);  // the piece counts the same either way
        if (x0 >= m_width)
            return;
        std::int64_t* difference = &m_difference[row * m_stride];
        if (x1 < 0.0) {
            difference[0] += sign * height;
            return;
        }

        const auto rise = static_cast<double>(height);
        auto texel = static_cast<std::int64_t>(std::max(x0, 0.0));
        const auto last = static_cast<std::int64_t>(std::min(x1, m_width));
        if (texel == last && x0 >= 0.0) {
            const std::int64_t mean = nearest(rise * (1.0 - (0.5 * (x0 + x1) - static_cast<double>(last))));
            difference[last] += sign * mean;
            difference[last + 1] += sign * (height - mean);
            return;
        }

        // Rise per texel. The limit keeps the quotient finite; a shorter piece leaves less than one unit beside it.
        const double slope = rise / std::max(x1 - x0, shortest_piece);
        std::int64_t covered = 0;
        const auto cover = [&](std::int64_t mean) {
            difference[texel++] += sign * (mean - covered);
            covered = mean;
        };
        if (x0 >= 0.0) {
            const double part = static_cast<double>(texel + 1) - x0;
            cover(nearest(0.5 * part * part * slope));
        }
        while (texel < last)
            cover(nearest((static_cast<double>(texel) + 0.5 - x0) * slope));
        if (x1 < m_width) {
            const double part = x1 - static_cast<double>(last);
            cover(height - nearest(0.5 * part * part * slope));
            cover(height);
        }
    }

    double m_bottom;
    double m_step;
    double m_width;
    std::size_t m_stride;
    std::vector<double> m_row_bottoms;  // in texels above m_bottom
    std::vector<std::int64_t> m_difference;
};

struct Polygon {
    std::span<const Vec2> corners;
    int sign;  // makes the covered area positive
    double bottom;
    double top;
};

// Twice the signed area, positive where the corners run anticlockwise.
double signed_area(std::span<const Vec2> corners)
{
    double sum = 0.0;
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        const Vec2 a = corners[i] - corners[0];
        const Vec2 b = corners[i + 1] - corners[0];
        sum += a.x * b.y - a.y * b.x;
    }
    return sum;
}

std::vector<Polygon> split(std::span<const Vec2> corners, std::span<const std::uint32_t> corner_counts)
{
    for (const Vec2& corner : corners) {
        if (!std::isfinite(corner.x) || !std::isfinite(corner.y))
            reject("corners", "not finite", "finite positions in texels");
    }
    std::vector<Polygon> polygons;
    std::size_t first = 0;
    for (const std::uint32_t count : corner_counts) {
        if (count < 3 || count > corners.size() - first)
            reject("corner_counts", std::to_string(count), "3 or more, their sum the number of corners");
        const std::span<const Vec2> outline = corners.subspan(first, count);
        const auto [low, high] =
            std::minmax_element(outline.begin(), outline.end(), [](const Vec2& a, const Vec2& b) { return a.y < b.y; });
        // A rising edge has the inside on its left if corners run anticlockwise, and counts on its right.
        polygons.push_back({outline, signed_area(outline) > 0.0 ? -1 : 1, low->y, high->y});
        first += count;
    }
    if (first != corners.size())
        reject("corner_counts", "a sum of " + std::to_string(first),
               "the number of corners, " + std::to_string(corners.size()));
    return polygons;
}

}  // namespace

void compute_coverage(std::span<const Vec2> corners, std::span<const std::uint32_t> corner_counts,
                      const CoverageOptions& options, const View2D<float>& coverage)
{
    if (options.row_step < 1)
        reject("row_step", std::to_string(options.row_step), "1 or more texels");
    const std::vector<Polygon> polygons = split(corners, corner_counts);
    const std::size_t bands = (coverage.height + rows_per_band - 1) / rows_per_band;
    const auto fill_band = [&](std::size_t index) {
        const std::size_t first = index * rows_per_band;
        const std::size_t rows = std::min(rows_per_band, coverage.height - first);
        Band band(first, rows, coverage.width, options.row_step);
        for (const Polygon& polygon : polygons) {
            if (polygon.top <= band.bottom() || polygon.bottom >= band.top())
                continue;
            for (std::size_t i = 0; i < polygon.corners.size(); ++i)
                band.add_edge(polygon.corners[i], polygon.corners[(i + 1) % polygon.corners.size()], polygon.sign);
        }
        for (std::size_t row = 0; row < rows; ++row)
            band.sum_row(row, coverage.row(first + row), options.is_cut);
    };
    with_threads(options.threads, [&] { parallel_for(bands, fill_band); });
}

}  // namespace beamspread
