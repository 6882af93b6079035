#include "scene/light.h"

namespace beamspread {

std::vector<LightSource> box_corners(const Vec3& low, const Vec3& high)
{
    std::vector<LightSource> corners;
    for (const double x : {low.x, high.x})
        for (const double y : {low.y, high.y})
            for (const double z : {low.z, high.z})
                corners.push_back({.position = Vec3(x, y, z)});
    return corners;
}

}  // namespace beamspread
