// A mesh of triangles that glow on both sides, each of its own radiance.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "scene/light.h"
#include "scene/occluder_mesh.h"

namespace beamspread {

class MeshLight final : public Light {
public:
    // `vertices` in world metres; `radiance` >= 0 of each triangle, W/(m^2 sr). Copied. Throws InvalidArgument.
    MeshLight(std::span<const Vec3> vertices, std::span<const Triangle> triangles, std::span<const Vec3f> radiance);
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    double distance_from(const Vec3& point) const override;
    std::vector<LightSource> corners() const override { return box_corners(m_low, m_high); }
    bool is_colored() const override { return m_is_colored; }
    // A copy whose near faces are sampled by solid angle, so that rays from points beside them have bounded flux.
    std::shared_ptr<const Light> facing_all() const override;

private:
    struct Face {
        std::array<Vec3, 3> corners;
        Vec3 normal;          // its length is twice the area
        double squared_size;  // squared length of the longest edge
        Vec3 radiance;
    };

    MeshLight() = default;
    // A ray to a near face, evenly over its solid angle; `probability` is that of the face.
    static LightRay near_ray(const Vec3& point, const Face& face, const Vec2& place, double probability);

    Vec3 m_low{0.0}, m_high{0.0};  // bounds of the glowing faces
    std::vector<Face> m_faces;
    std::vector<double> m_cumulated;  // sums of the faces' power, the mean of the channels; one more than faces
    bool m_is_colored = false;
    bool m_by_solid_angle = false;
};

}  // namespace beamspread
