// Lights of a size: lamps with a radius or an area, suns with an angle, the world, glowing meshes.
//
// In Cycles' units and by Cycles' formulas, like lights without size (light.h).
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "base/vec.h"

namespace beamspread {

// What one ray from a point towards a light finds.
struct LightRay {
    Vec3 travel;      // unit vector along which the light travels, world
    double distance;  // to the light, metres; may be infinite
    // W/m^2 on a square metre that faces the ray, over the density of rays: the mean over evenly spread `square` of
    // flux cos(theta) is the irradiance. 0 where the ray misses.
    Vec3f flux;
};

class ExtendedLight {
public:
    ExtendedLight() = default;
    ExtendedLight(const ExtendedLight&) = delete;
    ExtendedLight& operator=(const ExtendedLight&) = delete;
    virtual ~ExtendedLight() = default;

    // Writes a ray for each place of the unit square, from a point of a plane that is lit from the side of its normal.
    virtual void sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const = 0;

    // W/m^2 at a point of such a plane with nothing in between.
    virtual Vec3 irradiance(const Vec3& point, const Vec3& normal) const = 0;

    // The same light prepared for all points of planes with that normal, where that pays; null: it needs none.
    virtual std::unique_ptr<const ExtendedLight> facing(const Vec3& normal) const
    {
        static_cast<void>(normal);
        return nullptr;
    }

    // How near to a point it may come, at least; within a small part of it the irradiance hardly changes. Infinite: it is
    // the same at all points.
    virtual double distance_from(const Vec3& /*point*/) const { return std::numeric_limits<double>::infinity(); }

    // Whether rays of one light differ in colour; else all channels of `flux` are the same.
    virtual bool is_colored() const { return false; }
};

}  // namespace beamspread
