// Lights without extent, in Cycles' units and with Cycles' formulas.
//
// Measured against Cycles in Blender 3.4.1, 4.2, 4.5 and 5.0 (tests/blender/test_cycles_irradiance.py): a white diffuse
// plane baked with DIFFUSE / DIRECT shows E / pi, where
//     sun    E = S cos            S: the strength, W/m^2
//     point  E = P cos / (4 pi r^2)         P: the power, W; the lamp's scale does not matter
//     spot   E = P cos f / (4 pi r^2)       the power is that of the whole sphere, whatever the cone
// All lights here have S = 1 or P = 1 and no colour: light is linear in both.
#pragma once

#include <limits>
#include <variant>

#include "base/vec.h"

namespace beamspread {

// Light at one point of the scene.
struct Arrival {
    Vec3 travel{};  // unit vector along which it travels
    double flux = 0.0;  // on a square metre that faces it, W/m^2
    double distance = std::numeric_limits<double>::infinity();  // to the lamp, metres
};

// Where all light of a lamp comes from.
struct LightSource {
    Vec3 position{};  // of the lamp; of a light infinitely far away the unit vector towards it
    bool is_far = false;
};

class SunLight {
public:
    // `direction` of travel, any length but 0; throws InvalidArgument.
    explicit SunLight(const Vec3& direction);
    Arrival at(const Vec3& point) const;
    LightSource source() const { return {.position = -m_travel, .is_far = true}; }

private:
    Vec3 m_travel;
};

class PointLight {
public:
    // Throws InvalidArgument.
    explicit PointLight(const Vec3& position);
    Arrival at(const Vec3& point) const;
    LightSource source() const { return {.position = m_position}; }

private:
    Vec3 m_position;
};

// How the spot's falloff f follows from the angle theta between the lamp's -z axis and the ray; with
// c = cos(theta), c0 = cos(spot_size / 2), f = smoothstep((c - c0) / ((1 - c0) blend)), a step at c0 where blend is 0.
enum class SpotFalloff {
    // Measured in Blender 4.2, 4.5, 5.0; the change was made for 3.5 (D17129): c is taken in the lamp's own space, so a
    // scaled lamp has an elliptic cone. (Cycles culls the far side of the cone of a lamp that is sheared by its
    // parents; we do not.)
    scaled,
    // Blender 3.4: the lamp's scale is ignored, and f has a further factor c.
    legacy,
};

class SpotLight {
public:
    // The columns of `lamp_to_world` are the lamp's axes in the world with their scale, it shines along -z.
    // `spot_size` is the full angle of the cone in (0, pi], `blend` in [0, 1]. Throws InvalidArgument.
    SpotLight(const Vec3& position, const Mat3& lamp_to_world, double spot_size, double blend, SpotFalloff falloff);
    Arrival at(const Vec3& point) const;
    LightSource source() const { return m_point.source(); }

private:
    double falloff(const Vec3& travel) const;

    PointLight m_point;
    Mat3 m_world_to_lamp;
    double m_cos_half_size;
    double m_smooth;  // the span of cosines over which the border fades
    SpotFalloff m_falloff;
};

using Light = std::variant<SunLight, PointLight, SpotLight>;

}  // namespace beamspread
