// Rays between the texels of a receiver and a light: whether they arrive, and where shadow rays start and end.
//
// A mesh that bends shadows itself. Its rays start above the face of their texel, by a small part of the texel where faces
// bend. Where another face of the mesh rises within the texel, as in a crease, they start nearer to the texel's middle, so
// that none starts behind that face.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "scene/contacts.h"
#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

// Cosine of the angle of incidence below which light counts as travelling within the surface, and adds nothing: unit
// vectors in single precision are known to within this.
inline constexpr double min_cos_theta = 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon());

// Height above the face where shadow rays start, metres.
struct RayStart {
    double rounding = 0.0;  // bound of the rounding of a ray and of the triangles that it could meet at its start
    double clearance = 0.0;

    double height() const { return rounding + clearance; }
};

// Height above the face of a texel of a mesh that bends where its rays start, metres.
double height_of_rays(const RayStart& start, const BentTexel& texel);

// Bound of the rounding, metres, of a triangle as rays meet it, or of the instance in a hull.
double rounding_of(const std::array<Vec3, 3>& triangle, const Vec3& origin);
double rounding_of(const Hull& hull);

class ReceiverRays {
public:
    // `occluders` may be null. The grid must outlive the object.
    ReceiverRays(const ReceiverGrid& grid, const Occluders* occluders, double clearance);

    const RayStart& start() const { return m_start; }

    // Cosine of the angle of incidence of a ray that arrives at a texel; 0 if it comes from behind or within the surface by
    // the shading normal, and if the light is so near that its direction is not known.
    double arriving_cosine(std::size_t texel, const LightRay& ray) const
    {
        const double cos_theta = -glm::dot(ray.travel, m_grid.normal_at(texel));
        // Comparisons with NaN are false.
        return cos_theta > min_cos_theta && ray.distance > m_position_rounding ? cos_theta : 0.0;
    }

    // True if the texel's own face blocks a ray that comes from above by the shading normal.
    bool is_behind_face(std::size_t texel, const LightRay& ray) const
    {
        return m_grid.is_bent() && !(-glm::dot(ray.travel, Vec3(m_grid.bent_texel(texel).face)) > min_cos_theta);
    }

    // The shadow ray from a point of a texel toward the light.
    ShadowRay shadow_ray(std::size_t texel, const Vec3& point, const LightRay& ray) const;

    // The same on a mesh that bends, without a look at creases: it may start behind a face that cuts the texel.
    ShadowRay first_ray(std::size_t texel, const Vec3& point, const LightRay& ray) const;

private:
    double open_part(std::size_t texel) const;
    double find_open_part(const BentTexel& texel) const;
    ShadowRay ray_from(const Vec3& start, const Vec3& way, const Vec3& lift, double height, const LightRay& ray) const;
    std::pair<Vec3, double> bent_lift(std::size_t texel) const;

    const ReceiverGrid& m_grid;
    const Occluders* m_occluders;
    RayStart m_start;
    Contacts m_contacts;  // of a plane
    std::vector<std::uint8_t> m_covered;  // [texel] of a mesh that bends; empty: 0
    double m_position_rounding;  // metres
    // [texel] part of the way from the middle of a texel to its border that no face of the mesh blocks; below 0 until a ray
    // starts there; empty: 1. Threads that find the same one find the same value.
    mutable std::vector<std::atomic<float>> m_open_parts;
};

}  // namespace beamspread
