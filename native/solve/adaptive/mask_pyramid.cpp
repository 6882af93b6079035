#include "solve/adaptive/mask_pyramid.h"

#include <algorithm>

namespace beamspread {

MaskPyramid::MaskPyramid(const Plane& plane, const PlaneLight& light) : m_height(plane.height), m_width(plane.width)
{
    Level texels{m_height, m_width, std::vector<Cell>(m_height * m_width)};
    for (std::size_t y = 0; y < m_height; ++y)
        for (std::size_t x = 0; x < m_width; ++x) {
            const float value = light.irradiance(y, x);
            const Vec3f direction(value > 0.0f ? glm::normalize(travel_at(plane, light.directions, y, x)) : Vec3(0.0));
            texels.cells[y * m_width + x] = {value, value, static_cast<double>(value), direction, direction};
        }
    m_levels.push_back(std::move(texels));
    while (m_levels.back().height > 1 || m_levels.back().width > 1) {
        const Level& fine = m_levels.back();
        Level coarse{(fine.height + 1) / 2, (fine.width + 1) / 2, {}};
        coarse.cells.reserve(coarse.height * coarse.width);
        for (std::size_t y = 0; y < coarse.height; ++y)
            for (std::size_t x = 0; x < coarse.width; ++x) {
                const auto cell = [&](std::size_t dy, std::size_t dx) {
                    const bool inside = 2 * y + dy < fine.height && 2 * x + dx < fine.width;
                    return inside ? fine.cells[(2 * y + dy) * fine.width + 2 * x + dx] : Cell{};
                };
                coarse.cells.push_back(merge(merge(cell(0, 0), cell(0, 1)), merge(cell(1, 0), cell(1, 1))));
            }
        m_levels.push_back(std::move(coarse));
    }
}

MaskPyramid::Cell MaskPyramid::merge(const Cell& a, const Cell& b)
{
    return {std::min(a.least, b.least), std::max(a.greatest, b.greatest), a.sum + b.sum,
            glm::min(a.least_direction, b.least_direction), glm::max(a.greatest_direction, b.greatest_direction)};
}

std::vector<Square> MaskPyramid::squares(double tolerance) const
{
    std::vector<Square> found;
    search(m_levels.size() - 1, 0, 0, tolerance, found);
    return found;
}

void MaskPyramid::search(std::size_t level, std::size_t y, std::size_t x, double tolerance,
                         std::vector<Square>& found) const
{
    const Level& grid = m_levels[level];
    if (y >= grid.height || x >= grid.width)
        return;
    const Cell& cell = grid.cells[y * grid.width + x];
    if (!(cell.greatest > 0.0f))
        return;
    const std::size_t size = std::size_t{1} << level;
    const double mean = cell.sum / static_cast<double>(size * size);
    const double allowed = tolerance * static_cast<double>(cell.least);
    const bool even_light = cell.least > 0.0f && static_cast<double>(cell.greatest) - mean <= allowed &&
                            mean - static_cast<double>(cell.least) <= allowed;
    const bool even_direction =
        static_cast<double>(glm::length(cell.greatest_direction - cell.least_direction)) <= tolerance / 20.0;
    if (level == 0 || (even_light && even_direction)) {
        found.push_back({y * size, x * size, size, mean});
        return;
    }
    for (std::size_t dy = 0; dy < 2; ++dy)
        for (std::size_t dx = 0; dx < 2; ++dx)
            search(level - 1, 2 * y + dy, 2 * x + dx, tolerance, found);
}

}  // namespace beamspread
