#include "solve/adaptive/even_squares.h"

#include <algorithm>
#include <array>
#include <bit>

namespace beamspread {

namespace {

// The least and the greatest in a square, and the sum of its light.
struct Extent {
    float least = 0.0f;
    float greatest = 0.0f;
    double sum = 0.0;
    Vec3f least_direction{0.0f};
    Vec3f greatest_direction{0.0f};
};

Extent merge(const Extent& a, const Extent& b)
{
    return {std::min(a.least, b.least), std::max(a.greatest, b.greatest), a.sum + b.sum,
            glm::min(a.least_direction, b.least_direction), glm::max(a.greatest_direction, b.greatest_direction)};
}

class Search {
public:
    Search(const Plane& plane, const PlaneLight& light, double tolerance, std::vector<Square>& found)
        : m_plane(plane), m_light(light), m_tolerance(tolerance), m_found(found)
    {
    }

    // Of a square; those found in its quarters give way to it where it is even itself.
    Extent visit(std::size_t y, std::size_t x, std::size_t size)
    {
        if (y >= m_plane.height || x >= m_plane.width)
            return {};
        const std::size_t before = m_found.size();
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
        if (extent.greatest > 0.0f && (size == 1 || is_even(extent, mean))) {
            m_found.resize(before);
            m_found.push_back({y, x, size, mean});
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
        const double allowed = m_tolerance * static_cast<double>(extent.least);
        return extent.least > 0.0f && static_cast<double>(extent.greatest) - mean <= allowed &&
               mean - static_cast<double>(extent.least) <= allowed &&
               static_cast<double>(glm::length(extent.greatest_direction - extent.least_direction)) <=
                   m_tolerance / 20.0;
    }

    const Plane& m_plane;
    const PlaneLight& m_light;
    double m_tolerance;
    std::vector<Square>& m_found;
};

}  // namespace

std::vector<Square> even_squares(const Plane& plane, const PlaneLight& light, double tolerance)
{
    std::vector<Square> found;
    Search(plane, light, tolerance, found).visit(0, 0, std::bit_ceil(std::max(plane.height, plane.width)));
    return found;
}

}  // namespace beamspread
