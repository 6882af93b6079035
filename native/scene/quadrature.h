// Irradiance by a fixed set of rays: without noise between points, for what has no closed form.
#pragma once

#include "scene/extended_light.h"

namespace beamspread {

// W/m^2 from a light without colour; exact to about .1 % where its flux is smooth.
Vec3 mean_irradiance(const ExtendedLight& light, const Vec3& point, const Vec3& normal);

}  // namespace beamspread
