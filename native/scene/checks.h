// Helpers for the checks of arguments in this folder.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "base/constants.h"
#include "base/vec.h"

namespace beamspread::detail {

// Hosts that keep angles in single precision round pi up.
inline constexpr double max_angle = static_cast<double>(static_cast<float>(pi));

inline bool is_finite(const Vec3& v)
{
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

inline std::string to_text(const Vec3& v)
{
    std::ostringstream text;
    text << "(" << v.x << ", " << v.y << ", " << v.z << ")";
    return text.str();
}

}  // namespace beamspread::detail
