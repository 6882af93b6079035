// A sun: parallel light, or the light of a disk infinitely far away. Irradiance E = S cos(theta), S the strength in W/m^2.
#pragma once

#include <memory>

#include "base/constants.h"
#include "scene/light.h"
#include "scene/spherical_shapes.h"

namespace beamspread {

enum class SunDisk {
    // Even radiance, so that E = S at normal incidence: Blender 4.5.
    even,
    // A flat disk at distance 1, each part of which gives the same flux, S in all: Blender 3.4. E at normal incidence is
    // smaller, by 1.7 % for 30 degrees.
    flat,
};

class SunLight final : public Light {
public:
    // Largest angle, radians, of a sun whose axis stands for all its directions inside a medium. The error of the luminance
    // grows with the square of the angle: 6e-4 at 80 degrees of incidence, 5e-3 at 85.
    static constexpr double max_parallel_angle = 2.0 * pi / 180.0;

    // `direction` of travel from the disk's center, any length but 0; `angle`: full angle of the disk, 0 to pi radians.
    // Throws InvalidArgument.
    explicit SunLight(const Vec3& direction, double angle = 0.0, SunDisk disk = SunDisk::even);

    bool is_delta() const override { return m_sin_squared == 0.0; }
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    std::optional<LightSource> source() const override;
    std::vector<LightSource> corners() const override;
    // A flat disk with a table of its irradiance; this light must outlive it.
    std::shared_ptr<const Light> facing_all() const override;

private:
    LightRay ray(const Vec2& place) const;

    Vec3 m_travel;  // from the disk's center
    double m_angle;
    double m_sin_squared;  // of half the angle
    Cone m_cone;
    SunDisk m_disk;
};

}  // namespace beamspread
