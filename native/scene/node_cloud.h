// Nodes scattered over a surface, between which values are interpolated.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// Axes around a unit normal that change smoothly with it, except near (0, 0, -1) (Frisvad 2012, "Building an orthonormal
// basis from a 3D unit vector without normalization", doi:10.1080/2165347X.2012.689606). Directions at nodes and texels of
// a surface are in these frames, so that those of neighbors agree.
struct FieldFrame {
    Vec3 x, y, z;

    explicit FieldFrame(const Vec3& normal);

    Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
};

class NodeCloud {
public:
    NodeCloud() = default;

    // `spacing`: about the distance of neighbors, metres, > 0.
    NodeCloud(std::vector<Vec3> positions, std::vector<Vec3> normals, double spacing);

    std::size_t size() const { return m_positions.size(); }
    const std::vector<Vec3>& positions() const { return m_positions; }
    const std::vector<Vec3>& normals() const { return m_normals; }
    double spacing() const { return m_spacing; }

    // Nodes and their weights, which add up to 1; none if no node faces much the same way.
    using Weights = std::vector<std::pair<std::size_t, float>>;

    // Finds the nodes near a point of the surface, within a distance of `reach`, or farther if there is none: the nearer
    // and the more alike their normals, the more they weigh.
    void find(const Vec3& position, const Vec3& normal, double reach, Weights& weights) const;

private:
    using Cell = std::array<std::int64_t, 3>;

    Cell cell_of(const Vec3& position) const;

    std::vector<Vec3> m_positions;
    std::vector<Vec3> m_normals;
    double m_spacing = 1.0;
    double m_cell = 1.0;  // side of the cells that nodes are sorted by, metres
    std::vector<std::pair<Cell, std::uint32_t>> m_cells;  // sorted
};

}  // namespace beamspread
