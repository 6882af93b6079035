#include "ldf/samples/angular_space.h"

#include <cmath>

#include "base/constants.h"
#include "base/error.h"

namespace beamspread {

namespace {

// In heights. Farther out psi is pi/2 in double precision, which is no place any more.
constexpr double farthest = 1e15;

}  // namespace

AngularSpace::AngularSpace(const Vec2& origin, const Vec2& brightest, double height)
    : m_origin(origin), m_brightest(brightest), m_height(height)
{
    for (const double x : {origin.x, origin.y})
        if (!std::isfinite(x))
            reject("origin", x, "two finite numbers");
    for (const double x : {brightest.x, brightest.y})
        if (!std::isfinite(x))
            reject("brightest", x, "two finite numbers");
    if (!(height > 0.0 && std::isfinite(height)))
        reject("height", height, "height > 0");
}

AngularCoordinates AngularSpace::to_angular(const Vec2& place) const
{
    const Vec2 offset = place - m_brightest;
    if (const double distance = std::hypot(offset.x, offset.y); !(distance <= farthest * m_height))
        reject("u, v", distance, "places within 1e15 heights of the brightest point");
    const double phi = std::atan2(offset.y, offset.x);
    const double positive = phi < 0.0 ? phi + 2.0 * pi : phi;
    // A negative angle next to 0 is rounded to 2 pi.
    return {positive < 2.0 * pi ? positive : 0.0, std::atan2(std::hypot(offset.x, offset.y), m_height)};
}

Vec2 AngularSpace::to_planar(const AngularCoordinates& at) const
{
    if (!(at.psi >= 0.0 && at.psi < 0.5 * pi))
        reject("psi", at.psi, "0 <= psi < pi/2");
    if (!std::isfinite(at.phi))
        reject("phi", at.phi, "finite");
    const double r = m_height * std::tan(at.psi);
    return m_brightest + r * Vec2(std::cos(at.phi), std::sin(at.phi));
}

}  // namespace beamspread
