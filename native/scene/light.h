// Lights without size.
//
// Lights are in Cycles' units and follow Cycles' formulas, measured in Blender 3.4.1, 4.2, 4.5 and 5.0
// (tests/blender/test_cycles_irradiance.py): a white diffuse plane baked with DIFFUSE / DIRECT shows E / pi. They have
// strength 1, W/m^2 or W, and no colour: light is linear in both.
#pragma once

#include <span>

#include "base/vec.h"
#include "scene/spot_cone.h"

namespace beamspread {

// Light at one point of the scene.
struct Arrival {
    Vec3 travel;  // unit vector along which it travels
    double flux;  // on a square metre that faces it, W/m^2
    double distance;  // to the lamp, metres; may be infinite
};

// Where all light of a lamp comes from.
struct LightSource {
    Vec3 position{};  // of the lamp; of a light infinitely far away the unit vector towards it
    bool is_far = false;  // then light is the same everywhere
    bool is_smooth = false;  // but for the falloff with distance and cosine, light is even in all directions
};

class Light {
public:
    Light() = default;
    Light(const Light&) = delete;
    Light& operator=(const Light&) = delete;
    virtual ~Light() = default;

    // Writes what arrives at each of the points; in the lamp itself, at distance 0, that need not be numbers. Many
    // points at once: a call for each would cost a point lamp a quarter more time.
    virtual void arrive(std::span<const Vec3> points, Arrival* arrivals) const = 0;
    virtual LightSource source() const = 0;
};

// Parallel light: E = S cos(theta), S the strength in W/m^2.
class SunLight final : public Light {
public:
    // `direction` of travel, any length but 0; throws InvalidArgument.
    explicit SunLight(const Vec3& direction);
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = -m_travel, .is_far = true}; }

private:
    Vec3 m_travel;
};

// Light from one point into all directions: E = P cos(theta) / (4 pi r^2), P the power in W, whatever the lamp's scale.
class PointLight final : public Light {
public:
    // Throws InvalidArgument.
    explicit PointLight(const Vec3& position);
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = m_position, .is_smooth = true}; }

private:
    Vec3 m_position;
};

// A point light behind a cone: E = P cos(theta) f / (4 pi r^2), the power P that of the whole sphere, whatever the cone.
class SpotLight final : public Light {
public:
    // Throws InvalidArgument.
    SpotLight(const Vec3& position, const SpotCone& cone) : m_point(position), m_cone(cone) {}
    void arrive(std::span<const Vec3> points, Arrival* arrivals) const override;
    LightSource source() const override { return {.position = m_point.source().position}; }

private:
    PointLight m_point;
    SpotCone m_cone;
};

}  // namespace beamspread
