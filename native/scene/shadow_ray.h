// Rays between the texels of a receiver and a light: whether they arrive, and where shadow rays start and end.
#pragma once

#include <array>
#include <limits>

#include "scene/contacts.h"
#include "scene/light.h"
#include "scene/occluders.h"
#include "scene/receiver.h"

namespace beamspread {

// Cosine of the angle of incidence below which light counts as travelling within the surface, and adds nothing: unit
// vectors in single precision are known to within this.
inline constexpr double min_cos_theta = 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon());

// Height above the plane where shadow rays start, metres.
struct RayStart {
    double rounding = 0.0;  // bound of the rounding of a ray and of the triangles in the grid's plane
    double clearance = 0.0;

    double height() const { return rounding + clearance; }
};

// Bound of the rounding, metres, of a triangle as rays meet it, or of the instance in a hull.
double rounding_of(const std::array<Vec3, 3>& triangle, const Vec3& origin);
double rounding_of(const Hull& hull);

class ReceiverRays {
public:
    // `occluders` may be null. The grid must outlive the object.
    ReceiverRays(const ReceiverGrid& grid, const Occluders* occluders, double clearance);

    const RayStart& start() const { return m_start; }

    // Cosine of the angle of incidence of a ray that arrives; 0 if it comes from behind or within the plane, and if the
    // light is so near that its direction is not known.
    double arriving_cosine(const LightRay& ray) const
    {
        const double cos_theta = -glm::dot(ray.travel, m_grid.normal);
        // Comparisons with NaN are false.
        return cos_theta > min_cos_theta && ray.distance > m_position_rounding ? cos_theta : 0.0;
    }

    // The shadow ray from a point of the grid toward the light.
    ShadowRay shadow_ray(const Vec3& point, const LightRay& ray) const;

private:
    const ReceiverGrid& m_grid;
    RayStart m_start;
    Contacts m_contacts;
    double m_position_rounding;  // metres
};

}  // namespace beamspread
