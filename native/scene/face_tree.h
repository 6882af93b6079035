// A tree of the faces of a light, from which points draw near ones more often.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// The box around a face, and its power in any unit.
struct FaceBox {
    Vec3 low;
    Vec3 high;
    double power = 0.0;
};

// Two halves of the faces at each node, down to single ones. A half is drawn by its power over the squared distance, as in
// Conty and Kulla 2018, "Importance sampling of many lights with adaptive tree splitting"; faces far away by power alone.
class FaceTree {
public:
    FaceTree() = default;
    // All powers are > 0.
    explicit FaceTree(std::span<const FaceBox> faces);

    bool is_empty() const { return m_nodes.empty(); }

    struct Choice {
        std::size_t face = 0;
        double probability = 0.0;  // 0: all faces that might be drawn lie behind the surface
        double rest = 0.0;  // what is left of the number: one in [0, 1] again, which does not depend on the face
    };
    // Draws a face for a point of a surface with that normal; `number` in [0, 1).
    Choice choose(const Vec3& point, const Vec3& normal, double number) const;

private:
    struct Node {
        Vec3 centre{0.0};
        Vec3 half{0.0};
        double squared_radius = 0.0;
        std::uint32_t begin = 0;  // of its faces in `m_faces`
        std::uint32_t end = 0;
        std::uint32_t second = 0;  // second child, the first follows its parent; 0: none
    };

    std::uint32_t add(std::span<const FaceBox> faces, std::uint32_t begin, std::uint32_t end);
    double importance(const Node& node, const Vec3& point, const Vec3& normal) const;

    std::vector<Node> m_nodes;
    std::vector<std::uint32_t> m_faces;  // in the order of the leaves
    std::vector<double> m_cumulated;  // sums of their powers; one more than faces
};

}  // namespace beamspread
