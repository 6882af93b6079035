#include "solve/adaptive/even_squares.h"

#include <algorithm>
#include <array>
#include <bit>

namespace beamspread {

namespace {

// Bounds of irradiance and direction in a square, and the sum of its irradiance.
struct Extent {
    float min = 0.0f;
    float max = 0.0f;
    double sum = 0.0;
    Vec3f min_direction{0.0f};
    Vec3f max_direction{0.0f};
};

Extent merge(const Extent& a, const Extent& b)
{
    return {std::min(a.min, b.min), std::max(a.max, b.max), a.sum + b.sum, glm::min(a.min_direction, b.min_direction),
            glm::max(a.max_direction, b.max_direction)};
}

class Search {
public:
    Search(const Plane& plane, const PlaneLight& light, double tolerance, std::vector<Square>& squares)
        : m_plane(plane), m_light(light), m_tolerance(tolerance), m_squares(squares)
    {
    }

    // Returns the extent of a square, and adds its even parts: the square itself if it is even, else those of its
    // quarters.
    Extent visit(std::size_t y, std::size_t x, std::size_t size)
    {
        if (y >= m_plane.height || x >= m_plane.width)
            return {};
        const std::size_t before = m_squares.size();
        Extent extent;
        if (size == 1) {
            extent = texel(y, x);
        } else {
            const std::size_t half = size / 2;
            const std::array quarters = {visit(y, x, half), visit(y, x + half, half), visit(y + half, x, half),
                                         visit(y + half, x + half, half)};
            extent = merge(merge(quarters[0], quarters[1]), merge(quarters[2], quarters[3]));
        }
        const double mean = extent.sum / static_cast<double>(size * size);
        if (extent.max > 0.0f && (size == 1 || is_even(extent, mean))) {
            m_squares.resize(before);
            m_squares.push_back({y, x, size, mean});
        }
        return extent;
    }

private:
    Extent texel(std::size_t y, std::size_t x) const
    {
        const float value = m_light.irradiance(y, x);
        const Vec3f direction(value > 0.0f ? glm::normalize(travel_at(m_plane, m_light.directions, y, x)) : Vec3(0.0));
        return {value, value, static_cast<double>(value), direction, direction};
    }

    bool is_even(const Extent& extent, double mean) const
    {
        const double allowed = m_tolerance * static_cast<double>(extent.min);
        return extent.min > 0.0f && static_cast<double>(extent.max) - mean <= allowed &&
               mean - static_cast<double>(extent.min) <= allowed &&
               static_cast<double>(glm::length(extent.max_direction - extent.min_direction)) <= m_tolerance / 20.0;
    }

    const Plane& m_plane;
    const PlaneLight& m_light;
    double m_tolerance;
    std::vector<Square>& m_squares;
};

}  // namespace

std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance)
{
    std::vector<Square> squares;
    Search(plane, light, tolerance, squares).visit(0, 0, std::bit_ceil(std::max(plane.height, plane.width)));
    return squares;
}

Grid take_steps(Grid& light, const std::vector<Square>& squares)
{
    Grid steps(light.height + 1, light.width + 1);
    for (const Square& square : squares) {
        // Sum differences from the first texel: the mean of even light is then exact.
        const double first = light.row(square.y)[square.x];
        double sum = 0.0;
        for (std::size_t y = square.y; y < square.y + square.size; ++y) {
            for (std::size_t x = square.x; x < square.x + square.size; ++x)
                sum += light.row(y)[x] - first;
            std::fill_n(light.row(y) + square.x, square.size, 0.0);
        }
        const double mean = first + sum / static_cast<double>(square.size * square.size);
        steps.row(square.y)[square.x] += mean;
        steps.row(square.y)[square.x + square.size] -= mean;
        steps.row(square.y + square.size)[square.x] -= mean;
        steps.row(square.y + square.size)[square.x + square.size] += mean;
    }
    return steps;
}

KernelTable step_kernel(const Grid& kernel)
{
    KernelTable sums((kernel.height + 1) / 2, (kernel.width + 1) / 2);
    for (std::size_t y = 0; y < kernel.height; ++y) {
        const std::ptrdiff_t dy = static_cast<std::ptrdiff_t>(y) + 1 - sums.reach_y();
        const double* below = sums.row(dy - 1) + 1 - sums.reach_x();
        double* row = sums.row(dy) + 1 - sums.reach_x();
        double row_sum = 0.0;
        for (std::size_t x = 0; x < kernel.width; ++x) {
            row_sum += kernel.row(y)[x];
            row[x] = row_sum + below[x];
        }
    }
    return sums;
}

}  // namespace beamspread
