// A mesh of triangles that glow on both sides, each of its own radiance.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "scene/face_tree.h"
#include "scene/light.h"
#include "scene/occluder_mesh.h"

namespace beamspread {

class MeshLight final : public Light {
public:
    // `vertices` in world metres; `radiance` >= 0 of each triangle, W/(m^2 sr). Copied. `is_closed`: from outside of the
    // bounds of all vertices fronts hide all backs, see closed_mesh.h, so that no ray from there has to try them. Throws
    // InvalidArgument.
    MeshLight(std::span<const Vec3> vertices, std::span<const Triangle> triangles, std::span<const Vec3f> radiance,
              bool is_closed);
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override;
    std::vector<LightSource> corners() const override { return box_corners(m_low, m_high); }
    bool is_colored() const override { return m_is_colored; }
    // A copy without the faces that the rectangle can't see, whose rays go to the others by the irradiance that they bring.
    std::shared_ptr<const Light> facing(const Vec3& normal, std::span<const Vec3> points) const override;
    // A copy whose rays go to faces by their distance, and are spread over near ones by solid angle, so that those from
    // points beside them have bounded flux.
    std::shared_ptr<const Light> facing_all() const override;

private:
    struct Face {
        std::array<Vec3, 3> corners;
        Vec3 normal;          // its length is twice the area
        double squared_size;  // squared length of the longest edge
        Vec3 radiance;
    };

    MeshLight() = default;
    // A copy without faces.
    std::shared_ptr<MeshLight> without_faces() const;
    // True if fronts hide all backs from a point.
    bool shows_fronts_alone(const Vec3& point) const;
    static double height_of(const Face& face, const Vec3& point, const Vec3& normal);
    static Vec3 middle(const Face& face) { return (face.corners[0] + face.corners[1] + face.corners[2]) / 3.0; }
    static bool shows_back(const Face& face, const Vec3& point)
    {
        return glm::dot(face.normal, face.corners[0] - point) >= 0.0;
    }
    // A face for a ray from a point of a surface with that normal.
    FaceTree::Choice choose(const Vec3& point, const Vec3& normal, double number) const;
    // A ray to a near face, evenly over its solid angle; `probability` is that of the face.
    static LightRay near_ray(const Vec3& point, const Face& face, const Vec2& place, double probability);

    Vec3 m_low{0.0}, m_high{0.0};            // bounds of the glowing faces
    Vec3 m_body_low{0.0}, m_body_high{0.0};  // bounds of all vertices, with a margin
    std::vector<Face> m_faces;
    // Sums of the faces' weights, by which rays choose them; one more than faces. At first their power.
    std::vector<double> m_cumulated;
    FaceTree m_tree;  // by which rays choose faces instead; empty but in copies for all points
    bool m_is_colored = false;
    bool m_is_closed = false;
};

}  // namespace beamspread
