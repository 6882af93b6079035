// Irradiance of surfaces of any normal by light infinitely far away, which nothing blocks.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/vec.h"

namespace beamspread {

// Light from a small part of the sphere of directions.
struct SkyPart {
    Vec3 center{0.0, 0.0, 1.0};    // unit vector toward the middle of the part
    double reach = 0.0;            // largest distance of the part's unit vectors to the center
    std::array<double, 3> light{};  // [channel] sum of radiance times solid angle, W/m^2
    std::array<Vec3, 3> flow{};     // [channel] the same sum of unit vectors toward the light
};

// Parts in a tree of azimuth and elevation. The light of a part that lies wholly above the horizon of a normal is exact;
// parts that the horizon crosses are divided until they count little.
class SkyIrradiance {
public:
    SkyIrradiance() = default;

    // `finest`: parts row by row, of `width` columns; columns and rows are powers of two.
    SkyIrradiance(std::vector<SkyPart> finest, std::size_t width);

    // W/m^2 in each channel.
    Vec3 at(const Vec3& normal) const;

private:
    struct Level {
        std::size_t width;
        std::vector<SkyPart> parts;
    };

    void add(const Vec3& normal, std::size_t level, std::size_t x, std::size_t y, Vec3& sum) const;

    std::vector<Level> m_levels;  // the finest first
    double m_small = 0.0;         // W/m^2
};

}  // namespace beamspread
