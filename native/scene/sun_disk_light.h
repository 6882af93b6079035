// Light from a disk infinitely far away, of the strength S in W/m^2.
#pragma once

#include "scene/cone.h"
#include "scene/extended_light.h"

namespace beamspread {

enum class SunDisk {
    // Even radiance, so that E = S at normal incidence: Blender 4.5.
    even,
    // Even over a flat disk at the distance 1, each part of which gives the same flux, S in all; E at normal incidence
    // is smaller, by 1.7 % for 30 degrees: Blender 3.4.
    flat,
};

class SunDiskLight final : public ExtendedLight {
public:
    // `direction` of travel from the disk's centre, any length but 0; `angle` is the disk's full angle, 0 to pi. Throws
    // InvalidArgument.
    SunDiskLight(const Vec3& direction, double angle, SunDisk disk);
    void sample(const Vec3& point, const Vec3& normal, std::span<const Vec2> square, LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;

private:
    double m_sin_squared;  // of half the angle
    Cone m_cone;
    SunDisk m_disk;
};

}  // namespace beamspread
