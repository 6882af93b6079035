// Interface of all lights: lamps with and without a size, the world, glowing meshes.
//
// Lights use Cycles' units and formulas, measured in Blender 3.4.1, 4.2, 4.5 and 5.0
// (tests/blender/test_cycles_irradiance.py): a white diffuse plane baked with DIFFUSE / DIRECT shows E / pi. Lamps have
// strength 1 and no color, because light is linear in both. A lamp without a size is a lamp of size 0.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// One ray from a point toward a light.
struct LightRay {
    Vec3 travel;  // unit vector along which the light travels, world
    double distance;  // to the light, metres; may be infinite
    // W/m^2 on a surface that faces the ray, over the density of rays: the mean of flux cos(theta) over evenly spread
    // places of the unit square is the irradiance. 0 if the ray misses the light.
    Vec3f flux;
};

// The point or direction that all light of a lamp comes from.
struct LightSource {
    Vec3 position{};  // world; for a light infinitely far away the unit vector toward it
    bool is_far = false;  // true if the light is infinitely far away
    // True if only the distance and the cosine make irradiance change from point to point.
    bool is_smooth = false;
};

// The corners of a box along the axes of the world.
std::vector<LightSource> box_corners(const Vec3& low, const Vec3& high);

class DistantLight;

class Light {
public:
    Light() = default;
    Light(const Light&) = delete;
    Light& operator=(const Light&) = delete;
    virtual ~Light() = default;

    // True if one ray reaches each point, because the light has no size; such a light is white and has a source().
    virtual bool is_delta() const { return false; }

    // Writes a ray for each point of a surface with that normal, and for the place of the unit square of the same
    // index. A delta light ignores `square`, which may be empty. A ray from a point inside a delta light may hold NaN.
    virtual void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                        LightRay* rays) const = 0;

    // Irradiance of a surface with that normal where nothing blocks the light, W/m^2.
    virtual Vec3 irradiance(const Vec3& point, const Vec3& normal) const = 0;

    // A lower bound of the distance to the light, metres. Irradiance hardly changes within a small part of it; infinite:
    // irradiance is the same at all points.
    virtual double distance_from(const Vec3& /*point*/) const { return std::numeric_limits<double>::infinity(); }

    // Corners of a convex body that holds all points of the light, or directions between which all of it lies; none if the
    // light comes from all around.
    virtual std::vector<LightSource> corners() const { return {}; }

    // True if rays of the light differ in color; otherwise all channels of a ray's flux are equal.
    virtual bool is_colored() const { return false; }

    // The same light prepared for a rectangle with that normal; null if preparation does not pay. `points` lie evenly on
    // it, its four corners first.
    virtual std::shared_ptr<const Light> facing(const Vec3& /*normal*/, std::span<const Vec3> /*points*/) const
    {
        return nullptr;
    }

    // The same light prepared for points anywhere with any normal; null if preparation does not pay.
    virtual std::shared_ptr<const Light> facing_all() const { return nullptr; }

    // The light if its radiance is known in each direction; null for others.
    virtual const DistantLight* as_distant() const { return nullptr; }

    // The one point or direction that stands for the light inside a medium; none if its rays differ too much. Delta
    // lights and narrow suns have one.
    virtual std::optional<LightSource> source() const { return std::nullopt; }
};

// A light infinitely far away with a radiance in each direction.
class DistantLight : public Light {
public:
    const DistantLight* as_distant() const override { return this; }

    struct Seen {
        Vec3f radiance;  // W/(m^2 sr)
        double density = 0.0;  // of the rays of `sample`, 1/sr
    };

    // Light from the direction of a unit vector.
    virtual Seen seen(const Vec3& direction) const = 0;
};

}  // namespace beamspread
