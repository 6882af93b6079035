#include "scene/node_cloud.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "scene/checks.h"

namespace beamspread {

namespace {

// Side of a cell, in spacings. Larger: more nodes to look at, fewer cells.
constexpr double cell_in_spacings = 2.0;

// Times that the reach is doubled until a node lies within it.
constexpr int max_doublings = 4;

// A normal closer to (0, 0, -1) than this, by its z, has axes of its own: 1 + z has no digits left.
constexpr double downward = -1.0 + 1e-9;

}  // namespace

FieldFrame::FieldFrame(const Vec3& normal) : z(normal)
{
    if (normal.z < downward) {
        x = {0.0, -1.0, 0.0};
        y = {-1.0, 0.0, 0.0};
        return;
    }
    const double a = 1.0 / (1.0 + normal.z);
    const double b = -normal.x * normal.y * a;
    x = {1.0 - normal.x * normal.x * a, b, -normal.x};
    y = {b, 1.0 - normal.y * normal.y * a, -normal.y};
}

NodeCloud::NodeCloud(std::vector<Vec3> positions, std::vector<Vec3> normals, double spacing)
    : m_positions(std::move(positions)),
      m_normals(std::move(normals)),
      m_spacing(spacing),
      m_cell(cell_in_spacings * spacing)
{
    if (m_positions.size() != m_normals.size())
        reject("normals", std::to_string(m_normals.size()) + " rows",
               "one for each of the " + std::to_string(m_positions.size()) + " positions");
    if (!(spacing > 0.0) || !std::isfinite(spacing))
        reject("spacing", spacing, "a finite length > 0 in metres");
    for (std::size_t i = 0; i < size(); ++i) {
        detail::check_finite("positions", m_positions[i]);
        if (!(std::abs(glm::length(m_normals[i]) - 1.0) <= 1e-3))
            reject("normals", detail::to_text(m_normals[i]), "unit vectors");
        m_cells.emplace_back(cell_of(m_positions[i]), static_cast<std::uint32_t>(i));
    }
    std::ranges::sort(m_cells);
}

NodeCloud::Cell NodeCloud::cell_of(const Vec3& position) const
{
    const Vec3 cell = glm::floor(position / m_cell);
    return {static_cast<std::int64_t>(cell.x), static_cast<std::int64_t>(cell.y), static_cast<std::int64_t>(cell.z)};
}

void NodeCloud::find(const Vec3& position, const Vec3& normal, double reach, Weights& weights) const
{
    double sum = 0.0;
    for (int i = 0; i <= max_doublings && !(sum > 0.0); ++i, reach *= 2.0) {
        weights.clear();
        const Cell low = cell_of(position - reach);
        const Cell high = cell_of(position + reach);
        for (Cell cell = low; cell[0] <= high[0]; ++cell[0])
            for (cell[1] = low[1]; cell[1] <= high[1]; ++cell[1]) {
                // The cells of a line follow each other.
                const auto begin =
                    std::ranges::lower_bound(m_cells, std::pair(Cell{cell[0], cell[1], low[2]}, std::uint32_t{0}));
                for (auto node = begin; node != m_cells.end() && node->first[0] == cell[0] &&
                                        node->first[1] == cell[1] && node->first[2] <= high[2];
                     ++node) {
                    const std::size_t k = node->second;
                    const Vec3 way = m_positions[k] - position;
                    const double near = 1.0 - glm::dot(way, way) / (reach * reach);
                    const double alike = glm::dot(m_normals[k], normal);
                    if (!(near > 0.0 && alike > 0.0))
                        continue;
                    const double weight = near * near * alike * alike * alike * alike;
                    weights.emplace_back(k, static_cast<float>(weight));
                    sum += weight;
                }
            }
    }
    if (!(sum > 0.0))
        weights.clear();
    for (auto& [node, weight] : weights)
        weight = static_cast<float>(static_cast<double>(weight) / sum);
}

}  // namespace beamspread
