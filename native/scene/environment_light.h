// The world: radiance from all directions, infinitely far away, as an equirectangular image.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/view.h"
#include "scene/light.h"

namespace beamspread {

// An equirectangular image: from row 0 up the elevation rises from -pi / 2 to pi / 2, along a row the azimuth falls from
// pi to -pi, both in even steps; each pixel of even radiance. Large pixels are divided into cells.
struct EnvironmentMap {
    std::size_t width = 0;  // pixels
    std::size_t height = 0;
    std::size_t cells_x = 1;  // along a side of a pixel
    std::size_t cells_y = 1;
    std::vector<Vec3f> radiance;  // W/(m^2 sr), row by row
    Mat3 to_world{};

    const Vec3f& of_cell(std::size_t x, std::size_t y) const { return radiance[y / cells_y * width + x / cells_x]; }
};

class EnvironmentLight final : public Light {
public:
    // `radiance` >= 0 in W/(m^2 sr); `to_world` turns directions of the image into the world. Throws InvalidArgument.
    EnvironmentLight(const View2D<const Vec3f>& radiance, const Mat3& to_world);

    // Both use `facing`; callers with many points sample that, which chooses directions by radiance times cosine.
    void sample(std::span<const Vec3> points, const Vec3& normal, std::span<const Vec2> square,
                LightRay* rays) const override;
    Vec3 irradiance(const Vec3& point, const Vec3& normal) const override;
    // The last ones are kept: a bake asks for the same light several times.
    std::shared_ptr<const Light> facing(const Vec3& normal, std::span<const Vec3> points) const override;
    std::shared_ptr<const Light> facing_all() const override;
    bool is_colored() const override { return m_is_colored; }

private:
    // A light that was prepared for a normal, or for all.
    struct Prepared {
        std::optional<Vec3> normal;
        std::shared_ptr<const Light> light;
    };

    std::shared_ptr<const Light> prepared(std::vector<Prepared>& last, const std::optional<Vec3>& normal) const;

    EnvironmentMap m_map;
    bool m_is_colored = false;
    mutable std::mutex m_mutex;  // of the lights below
    mutable std::vector<Prepared> m_facing;
    mutable std::vector<Prepared> m_facing_all;
};

}  // namespace beamspread
