#include "scene/quadrature.h"

#include <algorithm>
#include <array>

namespace beamspread {

namespace {

constexpr std::size_t count = 144;

// A Fibonacci lattice, the best rank-1 lattice in two dimensions.
const std::array<Vec2, count>& lattice()
{
    static const std::array<Vec2, count> places = [] {
        std::array<Vec2, count> made;
        for (std::size_t i = 0; i < count; ++i)
            made[i] = Vec2(static_cast<double>(i) + 0.5, static_cast<double>(i * 89 % count) + 0.5) / double{count};
        return made;
    }();
    return places;
}

}  // namespace

Vec3 mean_irradiance(const ExtendedLight& light, const Vec3& point, const Vec3& normal)
{
    std::array<LightRay, count> rays;
    light.sample(point, normal, lattice(), rays.data());
    Vec3 sum(0.0);
    for (const LightRay& ray : rays)
        sum += Vec3(ray.flux) * std::max(-glm::dot(ray.travel, normal), 0.0);
    return sum / double{count};
}

}  // namespace beamspread
