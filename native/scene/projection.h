// Central projection of triangles from a point of a light onto a plane: the shadows that they cast.
//
// Bounds of shadows include the rounding of rays, so that what they tell is what tracing rays would find.
#pragma once

#include <array>
#include <limits>

#include "scene/light.h"
#include "scene/receiver.h"
#include "scene/shadow_ray.h"

namespace beamspread {

struct Interval {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();

    void extend(double x);
    void extend(const Interval& other);
};

// A triangle's shadow in texels.
struct Shadow {
    std::array<Vec2, 3> corners;
    Vec2 reach{};           // largest move by rounding
    bool is_whole = false;  // true if an opaque triangle lies wholly between the starts and the ends of rays

    Interval columns() const;
    Interval rows() const;
    // The part of a horizontal line inside the shadow; may be empty.
    Interval cut(double y) const;
};

class Projection {
public:
    Projection(const ReceiverGrid& grid, const LightSource& source, const RayStart& start);

    bool is_lit() const { return m_source_height > 0.0; }

    struct Heights {
        std::array<double, 3> corners;
        double lowest;
        double highest;
        double rounding;  // bound of the rounding of a ray and of the triangle
    };

    Heights heights(const std::array<Vec3, 3>& triangle, double rounding) const;
    // True if the triangle lies below the starts of rays, or beyond the lamp.
    bool is_off_the_way(const Heights& heights) const;
    // True if the shadow has an end, not too far away.
    bool has_shadow(const Heights& heights) const;
    Shadow shadow(const std::array<Vec3, 3>& triangle, bool is_opaque, const Heights& heights) const;

private:
    void project(const Vec3& vertex, double height, double rounding, Vec2& corner, Vec2& reach) const;
    double weight(double height) const { return m_source_height - m_is_near * height; }

    const ReceiverGrid& m_grid;
    Vec3 m_source;  // from the grid's origin to a lamp; the vector towards a sun
    double m_is_near;
    double m_source_height;
    RayStart m_start;
};

}  // namespace beamspread
