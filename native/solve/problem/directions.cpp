#include "solve/problem/directions.h"

#include <cmath>

#include "base/constants.h"

namespace beamspread {

double incidence_deg(const Vec3& direction)
{
    return std::atan2(std::hypot(direction.x, direction.y), -direction.z) / radians_per_degree;
}

double azimuth(const Vec3& direction)
{
    return std::atan2(direction.y, direction.x);
}

Vec3 direction_at(const Problem& problem, std::size_t y, std::size_t x)
{
    if (!problem.directions.field)
        return problem.directions.uniform;
    const float* d = problem.directions.field + 3 * (y * problem.width + x);
    return Vec3(d[0], d[1], d[2]);
}

}  // namespace beamspread
