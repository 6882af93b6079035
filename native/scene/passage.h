// What is left of a ray of light that crosses see-through surfaces.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// The order in which a hierarchy reports crossings is nobody's business: optical depths are added up in fixed point, so
// that any order has the same sum.
class Passage {
public:
    // Counts a crossing; false once nothing is left. Triangles that share an edge both report a ray that meets it:
    // crossings `at_edge` at the same distance count once, by the darkest of them.
    bool cross(const Vec3f& transmittance, float distance, bool at_edge);

    int crossings() const { return m_crossings; }
    Vec3f transmittance() const;

private:
    using Depth = std::array<std::int64_t, 3>;

    struct Edge {
        float distance;
        Depth depth;
    };

    Depth* edge_at(float distance);

    Depth m_depth{};
    int m_crossings = 0;
    std::vector<Edge> m_edges;
};

}  // namespace beamspread
